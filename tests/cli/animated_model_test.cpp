// Animated models as mesh sequences: an armature and a morph target of two animations, rendered in
// one line and as an end of a morph.
#include <cmath>

#include "testing/program.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// tests/data/models/make_animated.py says what bar.glb is: 25 poses. Its upper half turns about
/// (0, 1, 0) by 60 degrees at 0.25 s, and back at 0.5 s; the middle is twice as thick at 0.25 s.
class AnimatedModel : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    fs::copy_file(source_dir() / "tests/data/models/bar.glb", folder / "bar.glb");
  }
  /// Vertices of a pose in the file's own coordinates.
  std::vector<std::array<double, 3>> points_of(int pose) {
    write("bar.json", R"({"source": {"model": "bar@####.glb"}, "arrange": "none"})");
    const std::string frame = std::to_string(pose);
    run(0, {"mesh", "bar.json", "-f", frame, "-o", "pose" + frame + ".obj"});
    std::vector<std::array<double, 3>> points;
    for (const std::string& line : lines_of(read_text(folder / ("pose" + frame + ".obj")))) {
      std::array<double, 3> p{};
      if (std::sscanf(line.c_str(), "v %lf %lf %lf", &p[0], &p[1], &p[2]) == 3) points.push_back(p);
    }
    return points;
  }
  static double distance_to(const std::vector<std::array<double, 3>>& points, double x, double y,
                            double z) {
    double nearest = 1e9;
    for (const auto& p : points)
      nearest = std::min(nearest, std::hypot(std::hypot(p[0] - x, p[1] - y), p[2] - z));
    return nearest;
  }
  const std::vector<std::string> kSmall{"--set",           "image.width=32", "--set",
                                        "image.height=24", "--spp",          "1"};
};

TEST_F(AnimatedModel, BonesAndMorphTargetsAreWhereTheirKeysPutThem) {
  const auto rest = points_of(1), bent = points_of(7), between = points_of(4), back = points_of(13);
  ASSERT_EQ(rest.size(), 74u);
  ASSERT_EQ(bent.size(), rest.size());
  EXPECT_LT(distance_to(rest, 0, 2, 0), 1e-4);
  EXPECT_LT(distance_to(back, 0, 2, 0), 1e-4);
  const double root = std::sqrt(0.75);
  EXPECT_LT(distance_to(bent, -root, 1.5, 0), 1e-4);            // the top
  EXPECT_LT(distance_to(bent, 0, 0, 0), 1e-4);                  // the foot stays
  EXPECT_LT(distance_to(bent, 0.45, 1 + 0.3 * root, 0), 1e-4);  // the middle, on both bones
  EXPECT_LT(distance_to(between, -0.5, 1 + root, 0), 1e-4);     // half way: 30 degrees
  EXPECT_LT(distance_to(rest, 0.3, 1, 0), 1e-4);
}

TEST_F(AnimatedModel, RendersInOneLine) {
  std::vector<std::string> words{"render", "bar.glb", "-o", "out/f.####.png"};
  words.insert(words.end(), kSmall.begin(), kSmall.end());
  const Ran ran = run(0, words);
  EXPECT_TRUE(contains(ran.err, "25 frames rendered")) << ran.err;
  EXPECT_EQ(ran.err.find("ignored"), std::string::npos) << ran.err;
  const std::string rest = read_text(folder / "out/f.0001.png"),
                    bent = read_text(folder / "out/f.0007.png"),
                    other = read_text(folder / "out/f.0019.png");
  EXPECT_NE(rest, bent);
  EXPECT_NE(bent, other);
  words.push_back("--skip-existing");
  EXPECT_TRUE(contains(run(0, words).err, "0 frames rendered"));
}

TEST_F(AnimatedModel, IsASequenceForEveryCommand) {
  EXPECT_TRUE(contains(run(0, {"check", "bar.glb"}).out, "bar: 25 meshes, frames 1 to 25"));
  EXPECT_TRUE(contains(run(0, {"info", "bar@####.glb", "--timeline"}).out, "bar 25"));
  run(0, {"strip", "bar.glb", "-c", "3", "-o", "strip.png", "--set", "image.width=32", "--set",
          "image.height=24"});
  run(0, {"mesh", "bar.glb", "-o", "film.glb", "-f", "1,7"});
  EXPECT_TRUE(contains(run(0, {"analyze", "bar.glb"}).out, "bar@0001.glb -> bar@0025.glb"));
  // All poses have the same faces, so points tell the motion.
  const Ran blurred = run(0, {"render", "bar.glb", "-f", "4", "-o", "blur.png", "--set",
                              "camera.shutter=0.5", "--set", "image.width=32"});
  EXPECT_EQ(blurred.err.find("no motion blur"), std::string::npos) << blurred.err;
}

TEST_F(AnimatedModel, MovesThroughAMorph) {
  write("walk.json", R"({"source": {"model": "bar@####.glb", "loop": true}, "target": "cube",
    "frames": {"count": 12}, "spheres": {"balls": 12}, "surface": {"resolution": 24}})");
  EXPECT_TRUE(contains(run(0, {"info", "walk.json", "--timeline"}).out, "bar"));
  run(0, {"mesh", "walk.json", "-f", "1,6", "-o", "m.####.obj"});
  EXPECT_GT(read_text(folder / "m.0006.obj").size(), 1000u);
}

TEST_F(AnimatedModel, WhatIsNotAnimatedIsNoSequence) {
  fs::copy_file(source_dir() / "tests/data/models/box.glb", folder / "box.glb");
  EXPECT_TRUE(contains(run(1, {"check", "box@####.glb"}).err, "it is not animated"));
  EXPECT_TRUE(
      contains(run(3, {"render", "box.glb", "-o", "b.png"}).err, "is a model, not a scene"));
  EXPECT_TRUE(contains(run(1, {"check", "none@####.glb"}).err, "no such files"));
  // As one object it has the file's own pose.
  EXPECT_TRUE(contains(run(0, {"info", "bar.glb"}).err, "the animation is ignored"));
}

}  // namespace
}  // namespace polymorph
