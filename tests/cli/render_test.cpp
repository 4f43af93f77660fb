// render: what is written, what is said and where, and that a stopped run leaves whole frames.
#include <sys/stat.h>

#include <chrono>
#include <set>
#include <thread>

#include "base/program_identity.h"
#include "testing/program.h"

namespace polymorph {
namespace {

constexpr const char* kTwoGroups =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng low\nf 1 3 2\nf 1 2 4\ng high\nf 1 4 3\nf 2 3 4\n";

class Render : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene());
  }
  /// Frames that a report's "files" and the folder agree on.
  static std::vector<int> frames_of(const nlohmann::json& report) {
    std::vector<int> frames;
    for (const auto& frame : report["frames"]) frames.push_back(frame["frame"]);
    return frames;
  }
};

TEST_F(Render, WritesExrAndPng) {
  const Ran ran =
      run(0, {"render", "scene.json", "-o", "out/f.####.exr", "--png", "--device", "cpu"});
  EXPECT_EQ(ran.out, "");
  for (const char* number : {"0001", "0002", "0003", "0004"})
    for (const char* extension : {".exr", ".png"})
      EXPECT_TRUE(exists(std::string("out/f.") + number + extension));
  EXPECT_EQ(count_files(".part"), 0u);
  // Not a terminal: a line per frame, then the sum.
  auto lines = lines_of(ran.err);
  // A busy machine has time to say what it is at.
  std::erase_if(lines, [](const std::string& line) { return line.ends_with(" ..."); });
  ASSERT_EQ(lines.size(), 5u) << ran.err;
  EXPECT_TRUE(lines[0].starts_with("frame 1 1/4 ")) << lines[0];
  EXPECT_TRUE(lines[0].ends_with("ok out/f.0001.exr")) << lines[0];
  EXPECT_TRUE(lines[4].starts_with("4 frames rendered in ")) << lines[4];
}

TEST_F(Render, PngAlone) {
  run(0, {"render", "scene.json", "-o", "f.####.png", "-f", "2"});
  EXPECT_TRUE(exists("f.0002.png"));
  EXPECT_EQ(count_files(".exr"), 0u);
}

TEST_F(Render, RefusesExistingFrames) {
  run(0, {"render", "scene.json", "-o", "f.####.exr", "-f", "2-3"});
  const std::string before = read_text(folder / "f.0002.exr");
  const Ran ran = run(4, {"render", "scene.json", "-o", "f.####.exr", "--spp", "2"});
  EXPECT_TRUE(contains(ran.err, "f.0002.exr: exists, and 1 more - add --overwrite")) << ran.err;
  EXPECT_FALSE(exists("f.0001.exr"));
  EXPECT_EQ(read_text(folder / "f.0002.exr"), before);
  run(0, {"render", "scene.json", "-o", "f.####.exr", "--spp", "2", "--overwrite"});
  EXPECT_NE(read_text(folder / "f.0002.exr"), before);
  EXPECT_TRUE(exists("f.0001.exr"));
}

TEST_F(Render, SkipExistingKeepsCurrentFramesOnly) {
  run(0, {"render", "scene.json", "-o", "f.####.exr", "-f", "1-3"});
  // A frame of other settings, and a file that only has the name of a frame.
  run(0, {"render", "scene.json", "-o", "f.####.exr", "-f", "2", "--spp", "2", "--overwrite"});
  write("f.0003.exr", "not an image");
  const Ran ran = run(0, {"render", "scene.json", "-o", "f.####.exr", "--skip-existing", "--json"});
  const auto report = parse(ran.out);
  std::vector<std::string> states;
  for (const auto& frame : report["frames"]) states.push_back(frame["state"]);
  EXPECT_EQ(states, (std::vector<std::string>{"skipped", "done", "done", "done"}));
  EXPECT_TRUE(contains(ran.err, "f.0002.exr: is of another scene or settings")) << ran.err;
  EXPECT_TRUE(contains(ran.err, "3 frames rendered, 1 kept in ")) << ran.err;
  const Ran again = run(0, {"render", "scene.json", "-o", "f.####.exr", "--skip-existing"});
  EXPECT_TRUE(contains(again.err, "0 frames rendered, 4 kept")) << again.err;
}

/// What is kept is what would be rendered: files count by what is in them, not by their names.
TEST_F(Render, KeepsFramesWhateverTheSceneIsCalled) {
  write("tour/scene.json", tiny_scene(2, R"({"model": "models/a.obj", "spheres": {"balls": 4}})"));
  write("tour/models/a.obj", kTwoGroups);
  std::filesystem::create_directories(folder / "beside");
  std::filesystem::create_directory_symlink("tour", folder / "link");
  const std::string out = (folder / "f.####.png").string();
  run(0, {"render", "tour/scene.json", "-o", out});
  const Path top = folder;
  const auto kept = [&](const Path& from, const std::string& scene) {
    folder = from;
    const Ran ran = run(0, {"render", scene, "-o", out, "--skip-existing"});
    folder = top;
    EXPECT_TRUE(contains(ran.err, "0 frames rendered, 2 kept")) << scene << "\n" << ran.err;
  };
  kept(top, "./tour/../tour/scene.json");
  kept(top, "link/scene.json");
  kept(top, (top / "tour/scene.json").string());
  kept(top / "tour", "scene.json");
  kept(top / "beside", "../tour/scene.json");
}

TEST_F(Render, KeepsNoFrameThatWouldChange) {
  write("two.json", tiny_scene(2, R"({"model": "a.obj", "spheres": {"balls": 4}})"));
  write("a.obj", kTwoGroups);
  const std::vector<std::string> render{"render", "two.json", "-o", "f.####.png"};
  run(0, render);
  const auto rendered = [&](const std::vector<std::string>& more, const char* what) {
    std::vector<std::string> arguments = render;
    arguments.push_back("--skip-existing");
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_TRUE(contains(run(0, arguments).err, "2 frames rendered in")) << what;
    EXPECT_TRUE(contains(run(0, arguments).err, "0 frames rendered, 2 kept")) << what;
  };
  std::string names = kTwoGroups;
  names.replace(names.find("g low"), 5, "g top");
  names.replace(names.find("g high"), 6, "g low ");
  write("a.obj", names);
  rendered({}, "other groups");
  std::string none = names;
  while (none.find("g ") != std::string::npos) none.replace(none.find("g "), 2, "# ");
  write("a.obj", none);
  rendered({}, "no groups");
  rendered({"--set", "output.png_bits=16"}, "16 bits");
  rendered({"--set", "output.png_bits=16", "--set", "image.smooth=true"}, "smoothed");
}

TEST_F(Render, KeepsAnExrWhateverIsSaidOfPngs) {
  const std::vector<std::string> render{"render", "scene.json",     "-o", "f.####.exr", "-f",
                                        "1-2",    "--skip-existing"};
  run(0, render);
  const auto says = [&](const std::vector<std::string>& more, const std::string& what) {
    std::vector<std::string> arguments = render;
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Ran ran = run(0, arguments);
    EXPECT_TRUE(contains(ran.err, what)) << ran.err;
  };
  const std::string kept = "0 frames rendered, 2 kept";
  says({"--set", "output.png_bits=16"}, kept);
  says({"--png"}, "2 frames rendered in");
  says({"--png"}, kept);
  says({"--png", "--set", "output.png_bits=16"}, "2 frames rendered in");
  says({"--png", "--set", "output.png_bits=16"}, kept);
  EXPECT_EQ(run(0, {"status", "f.####.exr", "scene.json", "-f", "1-2", "--png", "--set",
                    "output.png_bits=16"})
                .code,
            0);
  EXPECT_EQ(run(1, {"status", "f.####.exr", "scene.json", "-f", "1-2", "--png"}).code, 1);
}

TEST_F(Render, DryRunWritesNothing) {
  const Ran ran = run(0, {"render", "scene.json", "-o", "out/f.####.exr", "--png", "-f", "2-3",
                          "-n", "--device", "cpu"});
  EXPECT_EQ(ran.out,
            "frame 2 volume out/f.0002.exr out/f.0002.png\n"
            "frame 3 volume out/f.0003.exr out/f.0003.png\n");
  EXPECT_TRUE(contains(ran.err, "2 frames to render: about ")) << ran.err;
  EXPECT_FALSE(exists("out"));
  const auto report = parse(run(0, {"render", "scene.json", "-n", "--json"}).out);
  EXPECT_EQ(report["frames"][3]["state"], "planned");
}

TEST_F(Render, FrameListInOrder) {
  const Ran ran = run(0, {"render", "scene.json", "-o", "f.####.exr", "-f", "4-1x3", "--json"});
  EXPECT_EQ(frames_of(parse(ran.out)), (std::vector<int>{4, 1}));
  EXPECT_EQ(count_files(".exr"), 2u);
}

TEST_F(Render, ShardsCoverEverythingOnce) {
  std::multiset<int> frames;
  for (const char* shard : {"1/3", "2/3", "3/3"}) {
    const Ran ran =
        run(0, {"render", "scene.json", "-o", "f.####.exr", "--shard", shard, "--json"});
    const auto mine = frames_of(parse(ran.out));
    frames.insert(mine.begin(), mine.end());
  }
  EXPECT_EQ(frames, (std::multiset<int>{1, 2, 3, 4}));
  EXPECT_EQ(count_files(".exr"), 4u);
}

TEST_F(Render, ShardWithoutFramesIsDone) {
  const Ran ran = run(0, {"render", "scene.json", "-f", "1", "--shard", "2/2", "--json"});
  EXPECT_TRUE(contains(ran.err, "no frames in this shard")) << ran.err;
  EXPECT_TRUE(parse(ran.out)["frames"].empty());
}

TEST_F(Render, ShardsOfASlurmArray) {
  variables = {{"SLURM_ARRAY_TASK_ID", "7"},
               {"SLURM_ARRAY_TASK_MIN", "5"},
               {"SLURM_ARRAY_TASK_STEP", "2"},
               {"SLURM_ARRAY_TASK_COUNT", "2"}};
  const Ran ran = run(0, {"render", "scene.json", "--shard", "auto", "--json", "-n"});
  EXPECT_EQ(frames_of(parse(ran.out)), (std::vector<int>{2, 4}));
}

TEST_F(Render, JsonReportIsAllOfStandardOutput) {
  const Ran ran = run(0, {"render", "scene.json", "-o", "f.####.exr", "--json", "--stats"});
  const auto report = parse(ran.out);
  EXPECT_EQ(report["version"], std::string(program_version()));
  EXPECT_EQ(report["stopped"], false);
  ASSERT_EQ(report["frames"].size(), 4u);
  EXPECT_EQ(report["frames"][1]["state"], "done");
  EXPECT_EQ(report["frames"][1]["stage"], "volume");
  EXPECT_GT(report["frames"][1]["triangles"], 100);
  EXPECT_EQ(report["frames"][1]["files"][0], "f.0002.exr");
  EXPECT_TRUE(contains(ran.err, "peak memory")) << ran.err;
  const Ran to_file =
      run(0, {"render", "scene.json", "--overwrite", "-o", "f.####.exr", "--json", "r.json"});
  EXPECT_EQ(to_file.out, "");
  EXPECT_EQ(parse(read_text(folder / "r.json"))["frames"].size(), 4u);
}

TEST_F(Render, ProgressAsJsonLines) {
  const Ran ran =
      run(0, {"render", "scene.json", "-o", "a \"b\\c.####.exr", "--progress", "json", "-q"});
  EXPECT_EQ(ran.out, "");
  const auto lines = lines_of(ran.err);
  ASSERT_EQ(lines.size(), 4u) << ran.err;
  const auto last = parse(lines[3]);
  EXPECT_EQ(last["frame"], 4);
  EXPECT_EQ(last["done"], 4);
  EXPECT_EQ(last["of"], 4);
  EXPECT_EQ(last["state"], "ok");
  EXPECT_EQ(last["file"], "a \"b\\c.0004.exr");
}

TEST_F(Render, NamesThatAreNotUtf8) {
  const Ran ran = run(0, {"render", "scene.json", "-o", "\xff.####.exr", "--json"});
  EXPECT_EQ(parse(ran.out)["frames"].size(), 4u);
  EXPECT_TRUE(exists("\xff.0001.exr"));
}

TEST_F(Render, QuietSaysNothing) {
  const Ran ran = run(0, {"render", "scene.json", "-o", "f.####.exr", "-q"});
  EXPECT_EQ(ran.out, "");
  EXPECT_EQ(ran.err, "");
}

TEST_F(Render, LogFileHoldsTheTalk) {
  run(0, {"render", "scene.json", "-o", "f.####.exr", "--log-file", "run.log"});
  EXPECT_TRUE(contains(read_text(folder / "run.log"), "4 frames rendered"));
}

TEST_F(Render, LogFileHasTheFormatThatIsAsked) {
  const std::vector<std::string> render{
      "render",          "scene.json", "-o",      "f.####.exr",   "-f",  "1",
      "--skip-existing", "--log-file", "run.log", "--log-format", "json"};
  run(0, render);
  run(0, render);  // appends to it
  const std::vector<std::string> lines = lines_of(read_text(folder / "run.log"));
  ASSERT_GE(lines.size(), 2u);
  for (const std::string& line : lines) {
    const auto entry = parse(line);
    EXPECT_EQ(entry["level"], "info") << line;
    EXPECT_EQ(entry["time"].get<std::string>().size(), 23u) << line;
    EXPECT_FALSE(entry["message"].get<std::string>().empty()) << line;
  }
}

TEST_F(Render, LogFileThatCannotBeWrittenIsAnError) {
  const std::vector<std::string> render{"render",     "scene.json", "-o", "f.####.exr",
                                        "--log-file", "/dev/full",  "-f", "1-2"};
  const Ran ran = run(4, render);
  const std::string error =
      "error: /dev/full: cannot write the log: No space left on device - the run goes on without";
  EXPECT_EQ(ran.err.find(error), ran.err.rfind(error)) << ran.err;
  EXPECT_TRUE(contains(ran.err, error)) << ran.err;
  EXPECT_TRUE(contains(ran.err, "2 frames rendered")) << ran.err;
  EXPECT_EQ(count_files(".exr"), 2u);
}

TEST_F(Render, SetChangesTheScene) {
  run(0, {"render", "scene.json", "-o", "one.exr", "-f", "1", "--set", "image.width=20", "--set",
          "image.height=10"});
  EXPECT_TRUE(contains(run(0, {"info", "one.exr"}).out, "one.exr: 20 x 10, "));
}

TEST_F(Render, NamesWithoutPattern) {
  run(0, {"render", "scene.json", "-o", "one.exr", "-f", "2"});
  EXPECT_TRUE(exists("one.exr"));
  run(0, {"render", "scene.json", "-o", "many.exr", "-f", "2-3"});
  EXPECT_TRUE(exists("many.0002.exr"));
  EXPECT_TRUE(exists("many.0003.exr"));
  EXPECT_FALSE(exists("many.exr"));
  // A shard of one frame must not claim the bare name: others write beside it.
  run(0, {"render", "scene.json", "-o", "shard.exr", "-f", "2-3", "--shard", "1/2"});
  EXPECT_TRUE(exists("shard.0002.exr"));
}

TEST_F(Render, ModelPathsAreRelativeToTheSceneFile) {
  write("a/models/tetra.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  write("a/scene.json", tiny_scene(2, "\"models/tetra.obj\""));
  std::filesystem::create_directories(folder / "b");
  folder /= "b";
  run(0, {"render", "../a/scene.json", "-o", "f.####.exr"});
  EXPECT_TRUE(exists("f.0002.exr"));
}

TEST_F(Render, KeepGoingReportsWhatFailed) {
  std::filesystem::create_directories(folder / "f.0002.exr");
  const Ran ran =
      run(6, {"render", "scene.json", "-o", "f.####.exr", "--overwrite", "--keep-going", "--json"});
  const auto report = parse(ran.out);
  EXPECT_EQ(report["frames"][1]["state"], "failed");
  EXPECT_TRUE(contains(report["frames"][1]["error"], "in the way"));
  EXPECT_EQ(report["frames"][3]["state"], "done");
  EXPECT_TRUE(contains(ran.err, "3 frames rendered, 1 failed")) << ran.err;
}

TEST_F(Render, StoppedBySignalLeavesWholeFrames) {
  write("long.json", tiny_scene(2000));
  for (const auto& [signal, code] : {std::pair(SIGTERM, 143), std::pair(SIGINT, 130)}) {
    const std::string prefix = code == 143 ? "term" : "int";
    const std::string name = prefix + ".####.exr";
    const Path third = folder / (prefix + ".0003.exr");
    const Started started = start({"render", "long.json", "-o", name, "--json"});
    for (int i = 0; i < 12000 && !std::filesystem::exists(third); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_EQ(::kill(started.id, signal), 0);
    const Ran ran = finish(started);
    EXPECT_EQ(ran.code, code) << ran.err;
    EXPECT_TRUE(contains(ran.err, "run again with --skip-existing")) << ran.err;
    const auto report = parse(ran.out);
    EXPECT_EQ(report["stopped"], true);
    EXPECT_GE(report["frames"].size(), 3u);
    EXPECT_LT(report["frames"].size(), 2000u);
    for (const auto& frame : report["frames"]) EXPECT_EQ(frame["state"], "done");
    EXPECT_EQ(count_files(".part"), 0u);
    run(0, {"compare", name, name, "--json", "compare.json", "--overwrite"});
    EXPECT_EQ(parse(read_text(folder / "compare.json"))["cases"].size(), report["frames"].size());
  }
}

TEST_F(Render, GoesOnWhenTheReaderOfItsOutputHasGone) {
  out_file = folder / "pipe";
  ASSERT_EQ(::mkfifo(out_file.c_str(), 0600), 0);
  const int reader = ::open(out_file.c_str(), O_RDONLY | O_NONBLOCK);
  const Started started = start({"render", "scene.json", "-o", "f.####.exr", "--json"});
  ::close(reader);
  EXPECT_EQ(finish(started).code, 0);
  EXPECT_EQ(count_files(".exr"), 4u);
}

/// Same pixels for any number of threads, alone or in a sequence, with a cold or a warm cache.
TEST_F(Render, PixelsDependOnTheSceneAlone) {
  const auto same = [&](const std::string& a, const std::string& b) {
    const Ran ran =
        run(0, {"compare", a, b, "--fail", "0", "--relative", "0", "--failpercent", "0"});
    EXPECT_TRUE(contains(ran.out, "all values are equal")) << ran.out;
  };
  const auto digests = [&](const std::vector<std::string>& arguments) {
    std::vector<std::string> all{"render", "scene.json", "--json", "--cache-dir", "cache"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::vector<std::string> result;
    const auto report = parse(run(0, all).out);
    for (const auto& frame : report["frames"]) result.push_back(frame["digest"]);
    return result;
  };
  const auto cold = digests({"-o", "one.####.exr", "-t", "1"});
  EXPECT_TRUE(exists("cache"));
  const auto warm = digests({"-o", "two.####.exr", "-t", "2"});
  EXPECT_EQ(cold, warm);
  EXPECT_NE(cold[1], cold[2]);
  same("one.####.exr", "two.####.exr");
  EXPECT_EQ(digests({"-o", "alone.exr", "-t", "2", "-f", "3", "--no-cache"}).front(), cold[2]);
  same("alone.exr", "one.0003.exr");
}

}  // namespace
}  // namespace polymorph
