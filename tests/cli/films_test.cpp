// Films: turntables, keyframes, rates, and a scene that is watched.
#include <chrono>
#include <thread>

#include "testing/program.h"

namespace polymorph {
namespace {

constexpr const char* kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

class Films : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene());
  }
  bool differ(const std::string& a, const std::string& b) {
    return run({"compare", a, b, "--fail", "0", "--relative", "0", "--failpercent", "0"}).code != 0;
  }
};

TEST_F(Films, ATurntableOfAModel) {
  write("model.obj", kTetrahedron);
  const std::vector<std::string> small{"--set",           "image.width=32", "--set",
                                       "image.height=24", "--spp",          "1"};
  std::vector<std::string> command{"render",     "model.obj", "--turntable",       "-o",
                                   "t.####.png", "--set",     "frames.turntable=4"};
  command.insert(command.end(), small.begin(), small.end());
  run(0, command);
  EXPECT_EQ(count_files(".png"), 4u);
  EXPECT_TRUE(differ("t.0001.png", "t.0003.png"));
  const Ran missing = run(3, {"render", "none.obj", "--turntable", "-o", "t.png"});
  EXPECT_TRUE(contains(missing.err, "none.obj: no such file")) << missing.err;
  // Some of its frames, which are the same as those of the whole turn.
  std::vector<std::string> some{"render",     "model.obj", "--turntable",       "-f", "2-3", "-o",
                                "u.####.png", "--set",     "frames.turntable=4"};
  some.insert(some.end(), small.begin(), small.end());
  run(0, some);
  EXPECT_FALSE(exists("u.0001.png"));
  EXPECT_FALSE(differ("u.0003.png", "t.0003.png"));
}

TEST_F(Films, ATurntableOfAFrameAndOfAFilm) {
  const auto report = parse(run(0, {"render", "scene.json", "--turntable", "-f", "2", "-o",
                                    "a.####.png", "--set", "frames.turntable=3", "--json"})
                                .out);
  ASSERT_EQ(report["frames"].size(), 3u);
  EXPECT_EQ(report["frames"][0]["digest"], report["frames"][2]["digest"]) << "one moment";
  EXPECT_TRUE(differ("a.0001.png", "a.0002.png"));
  run(0, {"render", "scene.json", "--turntable", "-o", "film.####.png"});
  run(0, {"render", "scene.json", "-o", "still.####.png"});
  EXPECT_EQ(count_files(".png"), 3u + 4 + 4);
  EXPECT_FALSE(differ("film.0002.png", "film.0002.png"));
  EXPECT_TRUE(differ("film.0002.png", "still.0002.png"));
  EXPECT_EQ(run({"render", "scene.json", "--turntable", "-f", "9", "-o", "b.####.png"}).code, 2);
  const Ran beyond = run(3, {"render", "scene.json", "-o", "b.####.png", "--set",
                             "frames.turntable=3", "--set", "frames.still=9"});
  EXPECT_TRUE(contains(beyond.err, "/frames/still: is 9, but the film has 4 frames")) << beyond.err;
  EXPECT_TRUE(contains(
      run(1, {"check", "scene.json", "--set", "frames.turntable=3", "--set", "frames.still=9"}).err,
      "/frames/still: is 9"));
}

TEST_F(Films, KeyframesChangeThePictures) {
  run(0, {"render", "scene.json", "-o", "a.####.png"});
  run(0, {"render", "scene.json", "-o", "b.####.png", "--set",
          R"(image.exposure={"keys": [{"t": 0, "value": 0}, {"t": 1, "value": 2}]})"});
  EXPECT_FALSE(differ("a.0001.png", "b.0001.png"));
  EXPECT_TRUE(differ("a.0004.png", "b.0004.png"));
  const Ran bad = run(2, {"render", "scene.json", "-o", "c.####.png", "--set",
                          R"(camera.fov={"keys": [{"t": 0, "value": 200}]})"});
  EXPECT_TRUE(contains(bad.err, "/camera/fov/keys/0/value: must be 1 to 150 (is 200)")) << bad.err;
}

/// Hundredths of a second that a GIF shows its first frame.
int delay_of(const std::string& gif) {
  const auto at = gif.find(std::string("\x21\xF9\x04", 3));
  EXPECT_NE(at, std::string::npos);
  return static_cast<unsigned char>(gif[at + 4]) + 256 * static_cast<unsigned char>(gif[at + 5]);
}

TEST_F(Films, GifsKeepTheRateOfTheirFrames) {
  run(0, {"render", "scene.json", "-o", "f.####.exr", "--png", "--set", "frames.fps=25"});
  run(0, {"strip", "f.####.png", "--gif", "png.gif"});
  run(0, {"strip", "f.####.exr", "--gif", "exr.gif"});
  run(0, {"strip", "f.####.png", "--gif", "other.gif", "--fps", "10"});
  EXPECT_EQ(delay_of(read_text(folder / "png.gif")), 4);
  EXPECT_EQ(delay_of(read_text(folder / "exr.gif")), 4);
  EXPECT_EQ(delay_of(read_text(folder / "other.gif")), 10);
}

TEST_F(Films, AWatchedSceneIsRenderedAgainWhenItChanges) {
  write("model.obj", kTetrahedron);
  const std::string source = R"({"model": "model.obj", "spheres": {"balls": 4}})";
  write("watched.json", tiny_scene(4, source));
  const Started started = start(
      {"render", "watched.json", "-f", "1", "-o", "look.png", "--watch", "--progress", "none"});
  const auto said = [&](const std::string& what, std::size_t times) {
    for (int i = 0; i < 3000; ++i) {
      const std::string text = read_text(started.err);
      std::size_t count = 0;
      for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
        ++count;
      if (count >= times) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  };
  EXPECT_TRUE(said("watching", 1)) << read_text(started.err);
  const std::string first = read_text(folder / "look.png");
  EXPECT_FALSE(first.empty());
  write("watched.json", tiny_scene(4, source, "  \"ground\": {\"color\": \"#ff0000\"},\n"));
  EXPECT_TRUE(said("watching", 2)) << read_text(started.err);
  const std::string second = read_text(folder / "look.png");
  EXPECT_NE(first, second);
  write("model.obj", std::string(kTetrahedron) + "v 2 2 2\nf 1 2 5\n");
  EXPECT_TRUE(said("watching", 3)) << read_text(started.err);
  EXPECT_NE(read_text(folder / "look.png"), second);
  // What is wrong is said, and may be mended.
  write("watched.json", "{");
  EXPECT_TRUE(said("watched.json:1", 1)) << read_text(started.err);
  write("watched.json", tiny_scene(4, source));
  EXPECT_TRUE(said("watching", 5)) << read_text(started.err);
  ::kill(started.id, SIGINT);
  EXPECT_EQ(finish_within(started, 30).code, 0);
}

TEST_F(Films, DenoisingSaysWhatItNeeds) {
  variables = {{"POLYMORPH_OIDN", "/nowhere/oidn.so"}};
  const Ran ran =
      run(5, {"render", "scene.json", "-o", "f.####.exr", "--set", "image.denoise=true"});
  EXPECT_TRUE(contains(ran.err, "pip install pyoidn")) << ran.err;
  EXPECT_EQ(count_files(".exr"), 0u);
}

}  // namespace
}  // namespace polymorph
