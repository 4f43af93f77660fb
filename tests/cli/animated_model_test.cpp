// Animated models as mesh sequences: an armature and a morph target of two animations, rendered in
// one line and as an end of a morph.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <utility>

#include "base/html_page.h"
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
  std::vector<std::array<double, 3>> points_of(int pose, const std::string& model = "bar@####.glb",
                                               int fps = 24) {
    write("bar.json", R"({"source": {"model": ")" + model +
                          R"("}, "arrange": "none", "frames": {"fps": )" + std::to_string(fps) +
                          "}}");
    const std::string frame = std::to_string(pose);
    run(0, {"mesh", "bar.json", "-f", frame, "-o", "pose" + frame + ".obj", "--overwrite"});
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

/// Bytes of a glTF buffer with the JSON of its views and accessors.
struct GltfBuffer {
  std::string bytes, views, accessors;
  int count = 0;

  /// Adds numbers as an accessor, and returns its index.
  template <class T>
  std::string add(const std::vector<T>& numbers, const std::string& type, std::size_t width,
                  const std::string& more = {}) {
    bytes.resize((bytes.size() + 3) / 4 * 4);
    const int code = sizeof(T) == 4 ? 5126 : std::is_signed_v<T> ? 5122 : 5123;
    views += (count ? "," : "") + std::string(R"({"buffer": 0, "byteOffset": )") +
             std::to_string(bytes.size()) + R"(, "byteLength": )" +
             std::to_string(numbers.size() * sizeof(T)) + "}";
    const auto [low, high] = std::minmax_element(numbers.begin(), numbers.end());
    accessors += (count ? "," : "") + std::string(R"({"bufferView": )") + std::to_string(count) +
                 R"(, "componentType": )" + std::to_string(code) + R"(, "count": )" +
                 std::to_string(numbers.size() / width) + R"(, "type": ")" + type + "\"" + more;
    if (type == "SCALAR")
      accessors +=
          R"(, "min": [)" + std::to_string(*low) + R"(], "max": [)" + std::to_string(*high) + "]";
    accessors += "}";
    bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T));
    return std::to_string(count++);
  }
};

/// The spline of a cubic pair of keys, from its definition.
double hermite(double u, double length, double a, double leaving, double arriving, double b) {
  return a * (1 + 2 * u) * (1 - u) * (1 - u) + b * u * u * (3 - 2 * u) +
         length * (leaving * u * (1 - u) * (1 - u) - arriving * u * u * (1 - u));
}

// Nodes and bones of one name: tangents, steps and a stretch before a turn, weights below 0,
// integers. Assimp's own keys put them up to 2 units away, or at NaN.
TEST_F(AnimatedModel, KeysAreSplinesStepsAndIntegersAsTheFileSays) {
  GltfBuffer buffer;
  using Floats = std::vector<float>;
  const std::string
      points = buffer.add(Floats{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, "VEC3", 3),
      faces =
          buffer.add(std::vector<std::uint16_t>{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}, "SCALAR", 1),
      right = buffer.add(Floats{0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3", 3),
      up = buffer.add(Floats{0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0}, "VEC3", 3),
      times = buffer.add(Floats{0, 0.75F}, "SCALAR", 1),
      slide = buffer.add(Floats{9, 9, 9, 0, 0, 0, 4, 0, 8, 0, -4, 0, 1, 2, 3, 9, 9, 9}, "VEC3", 3),
      stretch = buffer.add(Floats{1, 1, 1, 2, 1, 1}, "VEC3", 3),
      swell = buffer.add(Floats{9, 9, 0.2F, 0.4F, 2, -1, 0.5F, 3, 1, -0.5F, 9, 9}, "SCALAR", 1),
      turn =
          buffer.add(std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, 23170, 23170}, "VEC4", 4,
                     R"(, "normalized": true)"),
      joints = buffer.add(std::vector<std::uint16_t>(16), "VEC4", 4),
      shares = buffer.add(Floats{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}, "VEC4", 4),
      bind = buffer.add(Floats{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, "MAT4", 16);
  const std::string skinned = R"({"primitives": [{"attributes": {"POSITION": )" + points +
                              R"(, "JOINTS_0": )" + joints + R"(, "WEIGHTS_0": )" + shares +
                              R"(}, "indices": )" + faces + "}]}";
  const auto sampler = [&](const std::string& output, const std::string& interpolation) {
    return R"({"input": )" + times + R"(, "output": )" + output + R"(, "interpolation": ")" +
           interpolation + "\"}";
  };
  const auto channel = [](const char* sampler_index, const char* node, const std::string& path) {
    return std::string(R"({"sampler": )") + sampler_index + R"(, "target": {"node": )" + node +
           R"(, "path": ")" + path + "\"}}";
  };
  write(
      "keys.gltf",
      R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2, 3, 4, 5, 6]}], "nodes": [
        {"name": "body", "mesh": 0}, {"name": "body", "mesh": 0, "scale": [3, 1, 1], "translation": [20, 0, 0]},
        {"name": "body", "mesh": 1, "translation": [40, 0, 0]},
        {"mesh": 2, "skin": 0, "translation": [0, 50, 0]}, {"mesh": 3, "skin": 1, "translation": [0, 70, 0]},
        {"name": "bone", "translation": [60, 0, 0]}, {"name": "bone", "translation": [80, 0, 0]}],
        "skins": [{"joints": [5], "inverseBindMatrices": )" +
          bind + R"(}, {"joints": [6], "inverseBindMatrices": )" + bind + R"(}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": )" +
          points + R"(}, "indices": )" + faces +
          R"(}]}, {"primitives": [{"attributes": {"POSITION": )" + points + R"(}, "indices": )" +
          faces + R"(, "targets": [{"POSITION": )" + right + R"(}, {"POSITION": )" + up +
          R"(}]}], "weights": [0, 0]}, )" + skinned + "," + skinned +
          R"(], "animations": [{"samplers": [)" + sampler(slide, "CUBICSPLINE") + "," +
          sampler(stretch, "STEP") + "," + sampler(turn, "LINEAR") + "," +
          sampler(swell, "CUBICSPLINE") + R"(], "channels": [)" + channel("0", "0", "translation") +
          "," + channel("1", "0", "scale") + "," + channel("2", "1", "rotation") + "," +
          channel("3", "2", "weights") + "," + channel("1", "5", "scale") + "," +
          channel("2", "6", "rotation") + R"(]}], "bufferViews": [)" + buffer.views +
          R"(], "accessors": [)" + buffer.accessors + R"(], "buffers": [{"byteLength": )" +
          std::to_string(buffer.bytes.size()) +
          R"(, "uri": "data:application/octet-stream;base64,)" + base64(buffer.bytes) + "\"}]}");
  for (const int pose : {1, 7, 10, 18, 19}) {
    const auto found = points_of(pose, "keys@####.gltf");
    ASSERT_EQ(found.size(), 20u);
    const double length = 0.75, u = (pose - 1) / 24.0 / length;
    const double x = hermite(u, length, 0, 4, 0, 1), y = hermite(u, length, 0, 0, -4, 2),
                 z = hermite(u, length, 0, 8, 0, 3);
    EXPECT_LT(distance_to(found, x + (pose < 19 ? 1 : 2), y, z), 1e-5) << pose;
    EXPECT_LT(distance_to(found, x, y, z + 1), 1e-5) << pose;
    const double angle = u * std::acos(0.0);  // of a vertex that is stretched to 3, then turned
    EXPECT_LT(distance_to(found, 20 + 3 * std::cos(angle), 3 * std::sin(angle), 0), 1e-4) << pose;
    const double first = hermite(u, length, 0.2, 2, 0.5, 1),
                 second = hermite(u, length, 0.4, -1, 3, -0.5);
    EXPECT_LT(distance_to(found, 41 + first, 0, 0), 1e-5) << pose;
    EXPECT_LT(distance_to(found, 40, 1 + second, 0), 1e-5) << pose;
    EXPECT_LT(distance_to(found, pose < 19 ? 61 : 62, 0, 0), 1e-5) << pose;
    EXPECT_LT(distance_to(found, 80 + std::cos(angle), std::sin(angle), 0), 1e-4) << pose;
    EXPECT_LT(distance_to(found, 0, 50, 1), 1e-5) << pose << ": a vertex without bones";
  }
  // Keys that cannot be read are named; what they would move stays.
  std::string text = read_text(folder / "keys.gltf");
  text.replace(text.find("CUBICSPLINE"), 11, "LINEAR");
  write("odd.gltf", text);
  const Ran odd = run(0, {"check", "odd.gltf"});
  EXPECT_TRUE(contains(odd.out + odd.err, "keys of \"translation\" of node 0 cannot be read"))
      << odd.out << odd.err;
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
  EXPECT_TRUE(contains(run(0, {"info", "bar.glb"}).err, "is shown at rest"));
}

/// A file of Blender's exporter: tests/data/models/README.md.
class BlenderModel : public AnimatedModel {
 protected:
  void SetUp() override {
    AnimatedModel::SetUp();
    fs::copy_file(kFolder / "rig.glb", folder / "rig.glb");
  }
  const fs::path kFolder = source_dir() / "tests/data/models";
};

// Frames of Blender from its frame 10 on, at 30 per second: an action of the armature by its name,
// with the shape key's, a mirrored object on it, and what Blender's own evaluation says of them.
TEST_F(BlenderModel, PosesAreBlendersFrames) {
  std::map<std::pair<std::string, int>, std::vector<std::array<double, 3>>> shown;
  for (const std::string& line : lines_of(read_text(kFolder / "rig.txt"))) {
    char action[8] = {};
    int frame = 0;
    std::array<double, 3> p{};
    if (std::sscanf(line.c_str(), "%7s %d %lf %lf %lf", action, &frame, &p[0], &p[1], &p[2]) == 5)
      shown[{action, frame}].push_back(p);
  }
  ASSERT_EQ(shown.size(), 12u);
  for (const auto& [moment, points] : shown) {
    const auto& [action, frame] = moment;
    const auto found = points_of(frame, "rig@" + action + "@####.glb", 30);
    ASSERT_EQ(points.size(), 28u);
    for (const auto& [x, y, z] : points)
      EXPECT_LT(distance_to(found, x, y, z), 2e-6) << action << frame;
    for (const auto& [x, y, z] : found)
      EXPECT_LT(distance_to(points, x, y, z), 2e-6) << action << frame;
  }
}

TEST_F(BlenderModel, OneOfItsActionsIsChosenByName) {
  const Ran first = run(0, {"check", "rig.glb"});
  EXPECT_TRUE(contains(first.out, "rig: 19 meshes, frames 1 to 19")) << first.out;
  EXPECT_TRUE(contains(first.err, R"(plays "Bend", "TubeAction", not "Wave" - rig@Wave.glb)"))
      << first.err;
  const Ran wave = run(0, {"check", "rig@Wave.glb"});
  EXPECT_TRUE(contains(wave.out, "rig@Wave: 13 meshes")) << wave.out;
  EXPECT_EQ(wave.err.find("warning"), std::string::npos) << wave.err;
  EXPECT_TRUE(contains(run(0, {"check", "rig@Wave@####.glb"}).out, "13 meshes"));
  EXPECT_TRUE(contains(run(1, {"check", "rig@Wve@####.glb"}).err,
                       R"(has no animation "Wve" that moves anything - name "Bend", "Wave" or)"));
  EXPECT_TRUE(contains(run(1, {"check", "rig@Wve.glb"}).err, R"(no animation "Wve")"));
  EXPECT_TRUE(contains(run(1, {"check", "rig@0005.glb"}).err, "is a model, not a scene"));
  EXPECT_TRUE(contains(run(0, {"info", "rig.glb"}).out,
                       "3 animations, Bend, Wave, TubeAction: 19 poses, 30 per second"));
}

// 30 poses per second are a film of 30 frames per second, and at 12 frames per second two of five.
TEST_F(BlenderModel, KeepsItsPace) {
  EXPECT_TRUE(contains(run(0, {"info", "rig@####.glb"}).out, "19 frames at 30 fps"));
  write("slow.json", R"({"source": {"model": "rig@####.glb"}, "frames": {"fps": 12}})");
  EXPECT_TRUE(contains(run(0, {"info", "slow.json"}).out, "8 frames at 12 fps"));
  write("half.json", R"({"source": {"model": "rig@####.glb", "fps": 12}, "frames": {"fps": 12}})");
  EXPECT_TRUE(contains(run(0, {"info", "half.json"}).out, "19 frames at 12 fps"));
}

// Blender's mapping node, by the definition of its transform: scale, turn, shift.
TEST_F(BlenderModel, TexturesLieAsTheirMappingSays) {
  run(0, {"mesh", "rig.glb", "-f", "1", "-o", "rig.obj", "--set", "arrange=none"});
  std::vector<std::array<double, 3>> points;
  std::vector<std::array<double, 2>> uvs;
  std::size_t corners = 0;
  const double cosine = std::cos(0.5), sine = std::sin(0.5);
  for (const std::string& line : lines_of(read_text(folder / "rig.obj"))) {
    double a = 0, b = 0, c = 0;
    if (std::sscanf(line.c_str(), "v %lf %lf %lf", &a, &b, &c) == 3) points.push_back({a, b, c});
    if (std::sscanf(line.c_str(), "vt %lf %lf", &a, &b) == 2) uvs.push_back({a, b});
    unsigned p[3], t[3];
    if (std::sscanf(line.c_str(), "f %u/%u/%*u %u/%u/%*u %u/%u/%*u", &p[0], &t[0], &p[1], &t[1],
                    &p[2], &t[2]) != 6)
      continue;
    for (int k = 0; k < 3; ++k) {
      const auto& [x, y, z] = points.at(p[k] - 1);
      if (x > 0.5) continue;  // the cube
      const double u = 3 * (x - z / 2), v = 2 * (y / 2);
      EXPECT_NEAR(uvs.at(t[k] - 1)[0], cosine * u - sine * v + 0.25, 1e-4);
      EXPECT_NEAR(uvs.at(t[k] - 1)[1], sine * u + cosine * v + 0.125, 1e-4);
      ++corners;
    }
  }
  EXPECT_EQ(corners, 108u);
}

}  // namespace
}  // namespace polymorph
