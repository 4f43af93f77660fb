// Files that are there already: replaced only when told so, and never when they are read.
#include <sys/ioctl.h>
#include <sys/stat.h>

#include "image/image_io.h"
#include "testing/program.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class Outputs : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene());
    write("cube.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    write_picture("a.exr", 0.25f);
    write_picture("b.exr", 0.75f);
    write("golden_frames/tiny/suite.json", R"({"scene": "../../scene.json", "frames": [1]})");
  }
  void write_picture(const std::string& name, float value) const {
    Image image = make_image(8, 6, {"R", "G", "B"});
    for (float& v : image.pixels) v = value;
    const auto encoded = name.ends_with(".png") ? encode_png(image) : encode_exr(image);
    ASSERT_TRUE(encoded);
    write(name, *encoded);
  }
  /// Fails with code 4 and `part`, leaving the file as it is.
  void expect_kept(const std::vector<std::string>& arguments, const std::string& file,
                   const std::string& part) {
    const std::string before = read_text(folder / file);
    const Ran ran = run(4, arguments);
    EXPECT_EQ(ran.out, "");
    EXPECT_TRUE(contains(ran.err, "error: " + file + ": " + part)) << ran.err;
    EXPECT_EQ(read_text(folder / file), before) << file;
    EXPECT_EQ(count_files(".part"), 0u);
  }
};

TEST_F(Outputs, NoneReplacesAFileUnlessTold) {
  const std::vector<std::vector<std::string>> commands{
      {"check", "scene.json", "--json"},
      {"info", "scene.json", "--json"},
      {"info", "cube.obj", "--json"},
      {"devices", "--json"},
      {"cubes", "--json"},
      {"cache", "ls", "--json"},
      {"render", "scene.json", "-o", "f.png", "-f", "1", "--json"},
      {"compare", "a.exr", "b.exr", "--json"},
      {"compare", "a.exr", "b.exr", "--html"},
      {"compare", "a.exr", "b.exr", "--junit"},
      {"compare", "a.exr", "b.exr", "--diff"},
      {"golden", "test", "--html"},
      {"analyze", "scene.json", "--csv"},
      {"analyze", "scene.json", "--html"},
      {"mesh", "scene.json", "-f", "1", "-o"},
      {"strip", "scene.json", "-c", "1", "-o"},
      {"check", "scene.json", "--log-file"}};
  for (const auto& command : commands) {
    const std::string file = command.back() == "--diff" || command[0] == "strip" ? "there.png"
                             : command[0] == "mesh"                              ? "there.obj"
                                                                                 : "there.txt";
    write(file, "what somebody wrote\n");
    std::vector<std::string> arguments = command;
    arguments.push_back(file);
    expect_kept(arguments, file, "exists");
    arguments.push_back("--overwrite");
    const Ran told = run(arguments);
    EXPECT_TRUE(told.code == 0 || told.code == 1) << command[0] << told.err;
    if (command.back() != "--log-file") {  // check says nothing that would go there
      EXPECT_FALSE(contains(read_text(folder / file), "somebody")) << command[0];
    }
  }
  // What began this: the first name is the report's, not the scene's.
  expect_kept({"check", "--json", "scene.json", "cube.obj"}, "scene.json", "exists");
  write("report/index.html", "a page of somebody\n");
  expect_kept({"compare", "a.exr", "b.exr", "--report", "report"}, "report/index.html", "exists");
}

TEST_F(Outputs, NoneIsWrittenOverAnInput) {
  fs::create_symlink("scene.json", folder / "link.json");
  fs::create_hard_link(folder / "scene.json", folder / "same.json");
  fs::create_hard_link(folder / "cube.obj", folder / "same.obj");
  const std::string part = "is not written, because this command reads it";
  for (const char* name : {"scene.json", "link.json", "same.json", "./scene.json"})
    expect_kept({"check", "scene.json", "--overwrite", "--json", name}, name, part);
  expect_kept({"info", "scene.json", "--overwrite", "--log-file", "same.json"}, "same.json", part);
  expect_kept({"info", "cube.obj", "--overwrite", "--json", "same.obj"}, "same.obj", part);
  expect_kept({"compare", "a.exr", "b.exr", "--overwrite", "--diff", "b.exr"}, "b.exr", part);
  expect_kept({"strip", "scene.json", "--overwrite", "-c", "1", "--gif", "same.json"}, "same.json",
              part);
  write("two.json", tiny_scene(4, R"({"model": "cube.obj", "spheres": {"balls": 4}})"));
  expect_kept({"mesh", "two.json", "--overwrite", "-f", "1", "-o", "same.obj"}, "same.obj", part);
}

TEST_F(Outputs, NoneIsWrittenOverATexture) {
  write_picture("skin.png", 0.5f);
  write("box.mtl", "newmtl skin\nmap_Kd skin.png\n");
  write("box.obj",
        "mtllib box.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl skin\n"
        "f 1/1 3/2 2/3\nf 1/1 2/2 4/3\nf 1/1 4/2 3/3\nf 2/1 3/2 4/3\n");
  write("textured.json", tiny_scene(4, R"({"model": "box.obj", "spheres": {"balls": 4}})"));
  for (const char* more : {"--stats", "--keep-going"}) {
    const std::string before = read_text(folder / "skin.png");
    const Ran ran =
        run({"render", "textured.json", "-o", "skin.png", "-f", "1", "--overwrite", more});
    EXPECT_EQ(ran.code, std::string(more) == "--keep-going" ? 6 : 4) << ran.err;
    EXPECT_TRUE(contains(ran.err, "skin.png: is not written, because")) << ran.err;
    EXPECT_EQ(read_text(folder / "skin.png"), before);
  }
}

TEST_F(Outputs, AResumedRunGoesOnWithItsLogAndReport) {
  const std::vector<std::string> render{
      "render",      "scene.json",      "-o",         "f.####.png", "-f", "1", "--json",
      "report.json", "--skip-existing", "--log-file", "log.txt"};
  run(0, render);
  const std::string log = read_text(folder / "log.txt");
  run(0, render);
  EXPECT_TRUE(read_text(folder / "log.txt").starts_with(log));
  EXPECT_GT(read_text(folder / "log.txt").size(), log.size());
  EXPECT_EQ(parse(read_text(folder / "report.json"))["frames"][0]["state"], "skipped");
  write("report.json", "{\"version\": 1}\n");
  expect_kept(render, "report.json", "exists");
}

TEST_F(Outputs, APipeThatNobodyReadsIsAnError) {
  ASSERT_EQ(::mkfifo((folder / "pipe.png").c_str(), 0600), 0);
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"check", "scene.json", "--json", "pipe.png"},
           {"check", "scene.json", "--log-file", "pipe.png"},
           {"strip", "scene.json", "-c", "1", "-o", "pipe.png"}}) {
    const Ran ran = finish_within(start(arguments), 20);
    EXPECT_EQ(ran.code, 4) << ran.err;
    EXPECT_TRUE(contains(ran.err, "nobody reads this pipe - start its reader first")) << ran.err;
  }
  // One that is read gets everything, also what is more than a pipe holds.
  const int reader = ::open((folder / "pipe.png").c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  const Started cubes = start({"cubes", "--json", "pipe.png"});
  ::usleep(300000);
  std::string got;
  for (int tenth = 0; tenth < 100; ++tenth) {
    char buffer[4096];
    const ssize_t n = ::read(reader, buffer, sizeof buffer);
    if (n > 0) got.append(buffer, static_cast<std::size_t>(n));
    if (n == 0 && !got.empty()) break;
    if (n <= 0) ::usleep(100000);
  }
  ::close(reader);
  EXPECT_EQ(finish_within(cubes, 5).code, 0);
  EXPECT_EQ(got, run(0, {"cubes", "--json"}).out);
}

TEST_F(Outputs, ASignalEndsTheWaitForAReaderThatDoesNotRead) {
  ASSERT_EQ(::mkfifo((folder / "pipe.exr").c_str(), 0600), 0);
  const int reader = ::open((folder / "pipe.exr").c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  const Started render =
      start({"render", "scene.json", "-o", "pipe.exr", "-f", "1", "--overwrite", "--spp", "1",
             "--set", "image.width=640", "--set", "image.height=480"});
  int waiting = 0;  // until the pipe is full
  for (int before = -1, tenth = 0; tenth < 300 && (waiting == 0 || waiting != before); ++tenth) {
    before = waiting;
    ::usleep(100000);
    ::ioctl(reader, FIONREAD, &waiting);
  }
  EXPECT_GT(waiting, 0);
  ::kill(render.id, SIGTERM);
  const Ran ran = finish_within(render, 10);
  ::close(reader);
  EXPECT_EQ(ran.code, 143) << ran.err;
  EXPECT_TRUE(contains(ran.err, "stopped by a signal while its reader waited")) << ran.err;
}

TEST_F(Outputs, APipeInTheCacheIsNotWaitedFor) {
  const std::vector<std::string> spheres{"spheres", "cube.obj", "--balls",     "4",
                                         "--grid",  "16",       "--cache-dir", "cache"};
  run(0, spheres);
  std::vector<fs::path> entries;
  for (const auto& entry : fs::directory_iterator(folder / "cache")) entries.push_back(entry);
  ASSERT_EQ(entries.size(), 1u);
  fs::remove(entries[0]);
  ASSERT_EQ(::mkfifo(entries[0].c_str(), 0600), 0);
  const Ran ran = finish_within(start(spheres), 60);
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_TRUE(contains(ran.err, "the spheres are computed anew")) << ran.err;
  EXPECT_TRUE(contains(ran.err, "is a folder, a pipe or a device")) << ran.err;
}

}  // namespace
}  // namespace polymorph
