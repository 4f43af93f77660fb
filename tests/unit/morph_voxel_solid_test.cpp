#include "morph/voxel_solid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "testing/figure.h"

namespace polymorph {
namespace {

std::vector<std::uint32_t> distances_from(const VoxelSolid& solid, Vec3 place) {
  const std::uint32_t voxel = nearest_voxel(solid, place);
  return geodesic_distances(solid, std::span(&voxel, 1));
}
double at(const VoxelSolid& solid, const std::vector<std::uint32_t>& distances, Vec3 place) {
  return distances[nearest_voxel(solid, place)] * solid.unit();
}

TEST(VoxelSolid, HasTheVolumeAndDepthOfABall) {
  const VoxelSolid solid = voxel_solid({ball_at({1, 2, 3}, 0.5f)});
  const double cell = static_cast<double>(solid.grid.cell);
  EXPECT_NEAR(static_cast<double>(solid.size()) * cell * cell * cell, 4.18879 * 0.125, 0.02);
  const std::uint32_t middle = nearest_voxel(solid, {1, 2, 3});
  EXPECT_NEAR(solid.depth[middle] * solid.unit(), 0.5, 2 * cell);
  EXPECT_LT(length(solid.center(middle) - Vec3d{1, 2, 3}), cell);
  for (const std::uint32_t radius : local_radii(solid)) EXPECT_EQ(radius, solid.depth[middle]);
}

TEST(VoxelSolid, IsNothingWhereTheFieldIsLow) {
  EXPECT_EQ(voxel_solid({{{0, 0, 0}, 1, -1}}).size(), 0u);
}

TEST(VoxelSolid, WaysStayInside) {
  std::vector<Ball> horseshoe;  // three quarters of a ring in a plane
  for (int i = 0; i <= 60; ++i) {
    const float turn = 4.712389f * static_cast<float>(i) / 60;
    horseshoe.push_back(ball_at({std::cos(turn), std::sin(turn), 0}, 0.12f));
  }
  const VoxelSolid solid = voxel_solid(horseshoe);
  const auto distances = distances_from(solid, {1, 0, 0});
  EXPECT_NEAR(at(solid, distances, {0, -1, 0}), 4.712, 0.6);  // along the inner side: shorter
  EXPECT_NEAR(at(solid, distances, {std::cos(0.5f), std::sin(0.5f), 0}), 0.5, 0.06);
}

TEST(VoxelSolid, WaysAreNearlyStraightInAnyDirection) {
  const VoxelSolid solid = voxel_solid({ball_at({0, 0, 0}, 1)});
  const auto distances = distances_from(solid, {0, 0, 0});
  for (const Vec3 p : {Vec3{0.8f, 0, 0}, {0.5f, 0.5f, 0}, {0.4f, -0.4f, 0.4f}, {0.1f, 0.2f, -0.7f}})
    EXPECT_NEAR(at(solid, distances, p), static_cast<double>(length(p)),
                0.13 * static_cast<double>(length(p)));
}

TEST(VoxelSolid, PiecesAreJoinedByTheShortestWay) {
  const VoxelSolid solid = voxel_solid(
      {ball_at({-1, 0, 0}, 0.3f), ball_at({1, 0.2f, 0}, 0.4f), ball_at({3, 0, 0}, 0.2f)});
  const auto distances = distances_from(solid, {-1, 0, 0});
  EXPECT_NEAR(at(solid, distances, {1, 0.2f, 0}), 2, 0.26);
  EXPECT_NEAR(at(solid, distances, {3, 0, 0}), 4, 0.52);
}

TEST(VoxelSolid, LocalRadiiTellLimbsFromTheTrunk) {
  const VoxelSolid solid = voxel_solid(figure());
  const std::vector<std::uint32_t> radii = local_radii(solid);
  const auto radius = [&](Vec3 p) { return radii[nearest_voxel(solid, p)] * solid.unit(); };
  const double trunk = radius({0, 1.2f, 0}), arm = radius({0.8f, 1.5f, 0});
  EXPECT_GT(trunk, 1.8 * arm);
  EXPECT_NEAR(radius({0.75f, 1.55f, 0.05f}), arm, 0.3 * arm);  // near its surface, too
}

}  // namespace
}  // namespace polymorph
