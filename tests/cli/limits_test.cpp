// Small files that are much work, and machines that give little.
#include <sys/resource.h>

#include <cmath>

#include "testing/program.h"

namespace polymorph {
namespace {

class Limits : public ProgramTest {
 protected:
  /// Ends by itself, and within the seconds that a slow or busy machine needs.
  void expect_answer(int code, const std::vector<std::string>& arguments, const std::string& part) {
    const Ran ran = finish_within(start(arguments), 60);
    EXPECT_EQ(ran.code, code) << arguments[0] << " " << arguments[1] << "\n" << ran.err;
    EXPECT_TRUE(contains(ran.out + ran.err, part)) << ran.err;
  }
};

const std::string kTetrahedronPoints = "v 0 0 0\nv 1 0.1 0\nv 0 1 0.3\nv 0 0 1\n";
const char* const kTetrahedronFaces[] = {"f 1 3 2\n", "f 1 2 4\n", "f 1 4 3\n", "f 2 3 4\n"};

TEST_F(Limits, GroupsAndMaterials) {
  std::string groups = kTetrahedronPoints,
              materials = "mtllib m.mtl\nvt 0 0\n" + kTetrahedronPoints, library;
  for (int i = 0; i < 100000; ++i) {
    groups += "g group" + std::to_string(i) + "\n" + kTetrahedronFaces[i % 4];
    if (i >= 30000) continue;
    const std::string name = std::string("m").append(std::to_string(i));
    materials += "usemtl " + name + "\nf 1/1 2/1 " + std::to_string(3 + i % 2) + "/1\n";
    library += "newmtl " + name + "\nmap_Kd gone" + std::to_string(i) + ".png\n";
  }
  write("groups.obj", groups);
  write("materials.obj", materials);
  write("m.mtl", library);
  expect_answer(0, {"info", "groups.obj"}, "99996 triangles are there more than once");
  expect_answer(0, {"info", "materials.obj"}, "29998 triangles are there more than once");
  expect_answer(0, {"spheres", "groups.obj", "--balls", "8", "--grid", "16"}, "overlap");
}

TEST_F(Limits, EqualFaces) {
  std::string text = kTetrahedronPoints;
  for (int i = 0; i < 500000; ++i) text += kTetrahedronFaces[0];
  write("equal.obj", text);
  expect_answer(0, {"info", "equal.obj"}, "499999 triangles are there more than once");
}

TEST_F(Limits, APointOfManyEdges) {
  constexpr int kEdges = 50000;
  std::string text = "v 0 0 1\n";
  for (int i = 0; i < kEdges; ++i) {
    const double angle = 2 * 3.14159265358979 * i / kEdges;
    text += "v " + std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + " " +
            std::to_string(0.1 * std::sin(7 * angle)) + "\n";
  }
  for (int i = 0; i < kEdges; ++i)
    text += "f 1 " + std::to_string(2 + i) + " " + std::to_string(2 + (i + 1) % kEdges) + "\n";
  write("fan.obj", text);
  expect_answer(0, {"info", "fan.obj"}, "triangles");
  write("scene.json", R"({"source": "fan.obj", "target": {"shape": "sphere"}})");
  expect_answer(0, {"check", "scene.json"}, "fan: 50000 triangles");
}

TEST_F(Limits, APointOfManyEdgesAllAround) {
  constexpr int kEdges = 20000;
  std::string text = "v 0 0 0\n";
  for (int i = 0; i < kEdges; ++i) {  // neighbours lie anywhere on a sphere
    const double z = 2 * std::fmod(i * 0.618034, 1.0) - 1, flat = std::sqrt(1 - z * z),
                 turn = 1.7 * i * i;
    text += "v " + std::to_string(flat * std::cos(turn)) + " " +
            std::to_string(flat * std::sin(turn)) + " " + std::to_string(z) + "\n";
  }
  for (int i = 0; i < kEdges; ++i)
    text += "f 1 " + std::to_string(2 + i) + " " + std::to_string(2 + (i + 1) % kEdges) + "\n";
  write("heart.obj", text);
  expect_answer(0, {"spheres", "heart.obj", "--balls", "8", "--grid", "16"}, "overlap");
}

/// Faces strewn all around one point: every stage up to a surface is bounded.
TEST_F(Limits, ASurfaceOfStrewnFaces) {
  constexpr int kEdges = 100000;
  std::string text = "v 0 0 0\n";
  for (int i = 0; i < kEdges; ++i) {
    const double z = 2 * std::fmod(i * 0.618034, 1.0) - 1, flat = std::sqrt(1 - z * z),
                 turn = 1.7 * i * i;
    text += "v " + std::to_string(flat * std::cos(turn)) + " " +
            std::to_string(flat * std::sin(turn)) + " " + std::to_string(z) + "\n";
  }
  for (int i = 0; i < kEdges; ++i)
    text += "f 1 " + std::to_string(2 + i) + " " + std::to_string(2 + (i + 1) % kEdges) + "\n";
  write("strewn.obj", text);
  write("scene.json", R"({"source": "strewn.obj", "target": "cube", "spheres": {"balls": 8},
                          "surface": {"resolution": 24}})");
  expect_answer(0, {"mesh", "scene.json", "-f", "2", "-o", "m.obj", "--device", "cpu"}, "m.obj");
}

TEST_F(Limits, ManyActorsOfTwoShapes) {
  std::string actors;
  for (int i = 0; i < 500; ++i)
    actors += std::string(i > 0 ? "," : "") + R"({"source": "sphere", "target": "cube", )" +
              R"("translate": [)" + std::to_string(i) + ", 0, 0]}";
  write("scene.json", R"({"surface": {"resolution": 16}, "actors": [)" + actors + "]}");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_CPU, &before), 0);
  const rlimit seconds{15, before.rlim_max};  // 20 before each shape was looked at once
  ASSERT_EQ(::setrlimit(RLIMIT_CPU, &seconds), 0);
  const Started started = start({"check", "scene.json", "--max-memory", "0"});
  ::setrlimit(RLIMIT_CPU, &before);
  const Ran ran = finish_within(started, 60);
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_TRUE(contains(ran.out + ran.err, "1000 objects")) << ran.err;
}

/// Objects of very different size: what is taken is what was estimated.
TEST_F(Limits, AnObjectOfNearlyNoSize) {
  write("scene.json", R"({"source": {"shape": "sphere", "scale": 1e-6}, "target": "cube",
      "frames": {"count": 3}, "spheres": {"balls": 8}, "surface": {"resolution": 16},
      "image": {"width": 24, "height": 16, "samples": 1}})");
  const auto said =
      parse(run(0, {"check", "scene.json", "--json"}).out)["memory_bytes"].get<double>();
  const auto taken = parse(run(0, {"render", "scene.json", "-f", "2", "-o", "f.exr", "--json",
                                   "--no-cache", "--device", "cpu"})
                               .out)["peak_memory_bytes"]
                         .get<double>();
  EXPECT_LT(taken, 1.1 * said);
  EXPECT_LT(said, 400e6);
}

TEST_F(Limits, FacesOfManyCorners) {
  std::string text, face = "f";
  for (int i = 0; i < 4096; ++i) {  // a star that crosses itself everywhere
    const double angle = 2 * 3.14159265358979 * (i * 1453 % 4096) / 4096;
    text += "v " + std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + " 0\n";
    face += " " + std::to_string(i + 1);
  }
  for (int i = 0; i < 200; ++i) text += face + "\n";
  write("star.obj", text);
  expect_answer(0, {"info", "star.obj"}, "200 faces cross themselves");
}

TEST_F(Limits, ALineOfManyLibraries) {
  std::string text = "mtllib";
  for (int i = 0; i < 1000000; ++i) text += " m" + std::to_string(i) + ".mtl";
  write("many.obj", text + "\n" + kTetrahedronPoints + kTetrahedronFaces[0]);
  expect_answer(3, {"info", "many.obj"}, "many.obj:1: mtllib names more than 1000 material");
}

/// A stack larger than the memory that the process may have: no thread can be made.
TEST_F(Limits, NoThreadIsAMissingResource) {
  write("scene.json", tiny_scene());
  rlimit stack{}, memory{};
  ASSERT_EQ(::getrlimit(RLIMIT_STACK, &stack), 0);
  ASSERT_EQ(::getrlimit(RLIMIT_AS, &memory), 0);
  const rlimit large{rlim_t{16} << 30, stack.rlim_max}, small{rlim_t{6} << 30, memory.rlim_max};
  if (::setrlimit(RLIMIT_STACK, &large) != 0) GTEST_SKIP() << "the stack's size is limited here";
  if (::setrlimit(RLIMIT_AS, &small) != 0) GTEST_SKIP() << "memory is limited here";
  const Started started = start({"render", "scene.json", "-o", "f.####.png"});
  ::setrlimit(RLIMIT_AS, &memory);
  ::setrlimit(RLIMIT_STACK, &stack);
  const Ran ran = finish(started);
  EXPECT_EQ(ran.code, 5) << ran.err;
  EXPECT_TRUE(contains(ran.err, "error: no thread can be started (")) << ran.err;
  EXPECT_EQ(count_files(".png"), 0u);
}

}  // namespace
}  // namespace polymorph
