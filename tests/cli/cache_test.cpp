// The cache subcommand.
#include <fcntl.h>
#include <sys/stat.h>

#include <set>

#include "testing/program.h"

namespace polymorph {
namespace {

class CacheCommand : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene(4, R"({"shape": "cube", "spheres": {"balls": 12}})",
                                   "  \"spheres\": {\"fit\": \"none\"},\n"));
    run(0, {"mesh", "scene.json", "-f", "2", "-o", "m.obj", "--cache-dir", "kept"});
  }
  Ran cache(int code, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "cache");
    arguments.insert(arguments.end(), {"--cache-dir", "kept"});
    return run(code, arguments);
  }
};

TEST_F(CacheCommand, ListsWhatRenderingLeftThere) {
  const Ran ran = cache(0, {"ls"});
  EXPECT_TRUE(contains(ran.out, "kept: 6 files, ")) << ran.out;
  const auto json = parse(cache(0, {"ls", "--json"}).out);
  ASSERT_EQ(json["entries"].size(), 6u) << "spheres and distances of two, a plan and a pace";
  EXPECT_EQ(json["entries"][0]["key"].get<std::string>().size(), 32u);
  int sum = 0;
  for (const auto& entry : json["entries"]) sum += entry["bytes"].get<int>();
  EXPECT_EQ(json["bytes"], sum);
}

TEST_F(CacheCommand, SaysWhatEachFileWasMadeFrom) {
  std::multiset<std::string> made;
  const auto json = parse(cache(0, {"ls", "--json"}).out);
  for (const auto& entry : json["entries"])
    made.insert(entry["kind"].get<std::string>() + " of " + entry["origin"].get<std::string>());
  EXPECT_EQ(made, (std::multiset<std::string>{"distances of cube", "distances of sphere",
                                              "paces of cube, sphere", "plans of cube, sphere",
                                              "spheres of cube", "spheres of sphere"}));
  for (const std::string& line : lines_of(cache(0, {"ls"}).out))
    EXPECT_TRUE(contains(line, "cube") || contains(line, "sphere") || contains(line, "6 files"))
        << line;
}

TEST_F(CacheCommand, WhatIsNoFileIsLeftAloneAndHoldsNothingUp) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "kept"))
    names.push_back(entry.path().filename().string());
  ASSERT_EQ(names.size(), 6u);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Path file = folder / "kept" / names[i];
    std::filesystem::remove(file);
    if (i % 3 == 0) {
      ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
    }
    if (i % 3 == 1) std::filesystem::create_directory(file);
    if (i % 3 == 2) std::filesystem::create_symlink("/dev/full", file);
  }
  // Somebody reads the first pipe and never comes to its end.
  const int reader = ::open((folder / "kept" / names[0]).c_str(), O_RDONLY | O_NONBLOCK);
  const Ran ran = finish_within(
      start({"mesh", "scene.json", "-f", "2", "-o", "n.obj", "--cache-dir", "kept"}), 60);
  ::close(reader);
  EXPECT_EQ(ran.code, 0) << ran.err;
  const std::string before = read_text(folder / "m.obj"), after = read_text(folder / "n.obj");
  EXPECT_TRUE(before.substr(before.find("o cube")) == after.substr(after.find("o cube")));
  for (const std::string& name : names)
    EXPECT_TRUE(contains(ran.err, name + " is a folder, a pipe or a device - remove it")) << name;
  for (const char* verb : {"ls", "verify", "clear"})
    EXPECT_TRUE(contains(cache(0, {verb}).out, "0 files")) << verb;
  for (const std::string& name : names)
    EXPECT_TRUE(std::filesystem::exists(std::filesystem::symlink_status(folder / "kept" / name)));
}

TEST_F(CacheCommand, AnAbsentFolderIsEmpty) {
  EXPECT_TRUE(contains(run(0, {"cache", "ls", "--cache-dir", "none"}).out, "none: 0 files, 0"));
  run(0, {"cache", "verify", "--cache-dir", "none"});
  run(0, {"cache", "clear", "--cache-dir", "none"});
  EXPECT_FALSE(exists("none")) << "asking makes nothing";
}

TEST_F(CacheCommand, VerifyAnswersNoToADamagedFile) {
  const Ran good = cache(0, {"verify"});
  EXPECT_TRUE(contains(good.out, ": ok, ")) << good.out;
  std::string key;
  const auto kept = parse(cache(0, {"ls", "--json"}).out);
  for (const auto& entry : kept["entries"])
    if (entry["kind"] == "spheres") key = entry["key"].get<std::string>();
  std::string bytes = read_text(folder / "kept" / (key + ".spheres"));
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  write("kept/" + key + ".spheres", bytes);
  const Ran bad = cache(1, {"verify"});
  EXPECT_TRUE(contains(bad.out, key + ".spheres: is damaged")) << bad.out;
  EXPECT_TRUE(contains(bad.out, "1 bad")) << bad.out;
  const auto json = parse(cache(1, {"verify", "--json"}).out);
  EXPECT_EQ(json["ok"], false);
  for (const auto& entry : json["entries"]) EXPECT_EQ(entry["ok"], entry["key"] != key) << entry;
}

TEST_F(CacheCommand, VerifyAnswersNoToAShortFile) {
  const std::string key(32, 'a');
  for (const char* bytes : {"", "poly", "polymorph plan\n", "polymorph plan\n\3\0"}) {
    write("kept/" + key + ".plan", bytes);
    EXPECT_TRUE(contains(cache(1, {"verify"}).out, key + ".plan: is cut short")) << bytes;
  }
  std::filesystem::remove(folder / "kept" / (key + ".plan"));
  // What this program would not name like that is not its own.
  write("kept/notes.plan", "");
  cache(0, {"verify"});
}

TEST_F(CacheCommand, GcKeepsWhatFitsAndClearKeepsStrangers) {
  write("kept/mine.spheres", "not the program's");
  EXPECT_TRUE(contains(
      cache(0, {"gc", "--max-size", "1G", "--max-age", "30d"}).out,
      "removed 0 files, 0 B; kept 6 files"));  // balls and distances of two, a plan and a pace
  const auto json = parse(cache(0, {"gc", "--max-size", "0", "--json"}).out);
  EXPECT_EQ(json["removed"], 6);
  EXPECT_EQ(json["kept"], 0);
  run(0, {"mesh", "scene.json", "-f", "2", "-o", "again.obj", "--cache-dir", "kept"});
  EXPECT_TRUE(contains(cache(0, {"clear"}).out, "removed 6 files"));
  EXPECT_TRUE(exists("kept/mine.spheres"));
  EXPECT_EQ(count_files(".spheres"), 1u);
}

TEST_F(CacheCommand, WithoutAFolderSaysHowToGiveOne) {
  const Ran ran = run(2, {"cache", "ls", "--no-cache"});
  EXPECT_TRUE(contains(ran.err, "--cache-dir")) << ran.err;
}

}  // namespace
}  // namespace polymorph
