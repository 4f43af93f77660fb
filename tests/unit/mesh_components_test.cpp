#include "mesh/components.h"

#include <gtest/gtest.h>

#include "field/extract_surface.h"
#include "kernels/engine.h"
#include "mesh/mesh_check.h"

namespace polymorph {
namespace {

TEST(Components, SmallOnesAreRemovedAndLargeOnesKept) {
  const auto ball = [](float x, float radius) {
    return Ball{{x, 0, 0}, 4 / (radius * radius), 4, {}};
  };
  const auto engine = make_cpu_engine();
  // Volumes 1, 1/8 and 1/8000.
  const std::vector<Ball> balls = {ball(0, 1), ball(3, 0.5f), ball(-2, 0.05f)};
  const Mesh whole = *extract_surface(*engine, balls, 0.02f, {});
  ASSERT_EQ(check_mesh(whole).components, 3u);
  Mesh mesh = whole;
  EXPECT_EQ(remove_small_components(mesh, 1e-3), 1u);
  const MeshReport report = check_mesh(mesh);
  EXPECT_TRUE(report.is_closed());
  EXPECT_EQ(report.components, 2u);
  EXPECT_EQ(mesh.normals.size(), mesh.positions.size());
  for (const Vec3 p : mesh.positions) EXPECT_GT(p.x, -1.5f);
  Mesh kept = whole;
  EXPECT_EQ(remove_small_components(kept, 1e-5), 0u);
  EXPECT_EQ(kept.positions, whole.positions);
  EXPECT_EQ(remove_small_components(kept, 1), 2u) << "the largest part always stays";
  EXPECT_EQ(check_mesh(kept).components, 1u);
}

}  // namespace
}  // namespace polymorph
