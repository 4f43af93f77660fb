// Morphs between models that bound no solid.
#include <gtest/gtest.h>

#include <cmath>

#include "leg/leg_surface.h"
#include "mesh/mesh_check.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

class ShellTest : public SceneTest {
 protected:
  ShellTest() : SceneTest(R"("spheres": {"balls": 64}, "surface": {"resolution": 64})") {}

  /// Writes a dome and a box without a lid, of radius 1 and a height.
  void write_models(double height) {
    std::string dome, box = fmt::format(
                          "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\n"
                          "v -1 {0} -1\nv 1 {0} -1\nv 1 {0} 1\nv -1 {0} 1\n"
                          "f 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n",
                          height);
    constexpr int kAround = 24, kUp = 10;
    for (int i = 0; i < kAround; ++i)
      for (int j = 0; j < kUp; ++j) {
        const double a = 2 * M_PI * i / kAround, b = 0.48 * M_PI * j / (kUp - 1);
        dome += fmt::format("v {:.6f} {:.6f} {:.6f}\n", std::cos(a) * std::cos(b),
                            height * std::sin(b), std::sin(a) * std::cos(b));
      }
    for (int i = 0; i < kAround; ++i)
      for (int j = 0; j + 1 < kUp; ++j) {
        const int a = i * kUp + j + 1, b = (i + 1) % kAround * kUp + j + 1;
        dome += fmt::format("f {} {} {} {}\n", a, a + 1, b + 1, b);
      }
    EXPECT_TRUE(write_file(folder / "dome.obj", dome).ok());
    EXPECT_TRUE(write_file(folder / "box.obj", box).ok());
  }
  PreparedScene prepare() {
    return prepared_of(
        R"("source": {"model": "dome.obj"}, "target": {"model": "box.obj"}, "frames": {"count": 9})");
  }
};

TEST_F(ShellTest, WallsAreNeitherTornNorLeaveTheirEnds) {
  write_models(0.2);  // they surround too little to be vessels
  const PreparedScene prepared = prepare();
  ASSERT_EQ(prepared.actors.size(), 1u);
  const PreparedActor& actor = prepared.actors[0];
  for (const auto& object : actor.objects) EXPECT_TRUE(is_shell(object->distances)) << object->name;
  const float slack = 0.05f * actor.box.diagonal();
  for (const float time : {0.25f, 0.5f, 0.75f}) {
    const auto at = leg_surface(*actor.legs[0], time, *engine);
    ASSERT_TRUE(at.ok());
    const Mesh& mesh = at->mesh;
    const MeshReport check = check_mesh(mesh);
    EXPECT_TRUE(check.is_closed()) << time;
    // One wall with a few pinholes at most; how many hangs on the last bits of the fit (7 were
    // seen).
    EXPECT_EQ(check.components, 1u) << time;
    EXPECT_LE(check.genus, 10) << time;
    // Thin: far less than what it goes around.
    EXPECT_LT(volume_of(mesh), 0.5 * static_cast<double>(actor.box.size().x * actor.box.size().y *
                                                         actor.box.size().z));
    for (const Vec3 p : mesh.positions) {
      ASSERT_TRUE(p.x > actor.box.low.x - slack && p.x < actor.box.high.x + slack);
      ASSERT_TRUE(p.y > actor.box.low.y - slack && p.y < actor.box.high.y + slack);
      ASSERT_TRUE(p.z > actor.box.low.z - slack && p.z < actor.box.high.z + slack);
    }
  }
}

TEST_F(ShellTest, VesselsAreFullOnTheWay) {
  write_models(1);
  const PreparedScene prepared = prepare();
  const PreparedActor& actor = prepared.actors.at(0);
  double full = 0;
  for (const auto& object : actor.objects) {
    EXPECT_TRUE(object->distances.is_vessel) << object->name;
    full += 0.5 * object->distances.volume;
  }
  for (const float time : {0.25f, 0.5f, 0.75f}) {
    const auto at = leg_surface(*actor.legs[0], time, *engine);
    ASSERT_TRUE(at.ok());
    const MeshReport check = check_mesh(at->mesh);
    EXPECT_TRUE(check.is_closed()) << time;
    EXPECT_EQ(check.components, 1u) << time;
    if (time == 0.5f) {
      EXPECT_EQ(check.genus, 0);
      EXPECT_NEAR(volume_of(at->mesh), full, 0.1 * full);
    }
  }
  // Near its end it is as hollow as the model itself.
  const auto start = leg_surface(*actor.legs[0], 0.02f, *engine);
  ASSERT_TRUE(start.ok());
  EXPECT_LT(volume_of(start->mesh), 0.5 * actor.objects.front()->distances.volume);
}

}  // namespace
}  // namespace polymorph
