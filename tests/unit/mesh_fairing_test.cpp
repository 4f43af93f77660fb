#include "mesh/fairing.h"

#include <gtest/gtest.h>

#include "field/extract_surface.h"
#include "kernels/engine.h"
#include "mesh/mesh_check.h"

namespace polymorph {
namespace {

Mesh ball() {
  return *extract_surface(*make_cpu_engine(), std::vector<Ball>{{{0, 0, 0}, 4, 4, {}}}, 0.1f, {});
}

TEST(Fairing, OnlyNormalsThatPointBehindATriangleAreMended) {
  const Mesh sound = ball();
  Mesh mesh = sound;
  EXPECT_EQ(repair_normals(mesh), 0u);
  EXPECT_EQ(mesh.normals, sound.normals);
  mesh.normals[7] = sound.normals[7] * -1.0f;
  EXPECT_EQ(repair_normals(mesh), 1u);
  EXPECT_GT(dot(mesh.normals[7], sound.normals[7]), 0.99f);
  EXPECT_EQ(mesh.positions, sound.positions);
  for (std::size_t v = 0; v < mesh.normals.size(); ++v)
    if (v != 7) {
      EXPECT_EQ(mesh.normals[v], sound.normals[v]);
    }
}

TEST(Fairing, APeakIsFlattenedAndWhatIsFarFromItStays) {
  const Mesh sound = ball();
  Mesh mesh = sound;
  mesh.positions[0] = mesh.positions[0] * 1.3f;
  const std::uint32_t peak[] = {0};
  fair(mesh, peak, 20);
  EXPECT_LT(length(mesh.positions[0]), 1.02f * length(sound.positions[0]));
  std::size_t moved = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    moved += !(mesh.positions[v] == sound.positions[v]);
  EXPECT_LT(moved, 40u);
  EXPECT_GT(dot(mesh.normals[0], sound.normals[0]), 0.95f);
  EXPECT_TRUE(check_mesh(mesh).is_manifold());
}

}  // namespace
}  // namespace polymorph
