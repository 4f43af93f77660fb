#include "field/thinness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "testing/field.h"

namespace polymorph {
namespace {

/// Of a box, exactly.
float box_distance(Vec3 p, Vec3 center, Vec3 half) {
  const Vec3 d = {std::abs(p.x - center.x) - half.x, std::abs(p.y - center.y) - half.y,
                  std::abs(p.z - center.z) - half.z};
  const Vec3 out = max(d, Vec3{});
  return -(length(out) + std::min(std::max({d.x, d.y, d.z}), 0.0f));
}

/// A cube of edge 2 about the origin, from whose side x = 1 a rod of edge 0.2 sticks out to x = 3.
DistanceGrid cube_with_rod(float cell) {
  DistanceGrid out;
  const auto points = [&](float length) {
    return static_cast<int>(std::lround(length / cell)) + 1;
  };
  out.grid = {{-1.2f, -1.2f, -1.2f}, cell, {points(4.4f), points(2.4f), points(2.4f)}};
  for (int z = 0; z < out.grid.points.z; ++z)
    for (int y = 0; y < out.grid.points.y; ++y)
      for (int x = 0; x < out.grid.points.x; ++x) {
        const Vec3 p = grid_point(out.grid, {x, y, z});
        out.values.push_back(std::max(box_distance(p, {0, 0, 0}, {1, 1, 1}),
                                      box_distance(p, {1.5f, 0, 0}, {1.5f, 0.1f, 0.1f})));
      }
  return out;
}
constexpr float kRodSize = 4;

TEST(Thinness, IsOfTheRodAndNotOfTheCube) {
  const DistanceGrid thin = compute_thinness(cube_with_rod(0.02f), kRodSize);
  // Its half thickness is 0.1 of 0.24; coarse cells are 0.08.
  const float rod = 1 - (0.1f / 0.24f) * (0.1f / 0.24f);
  for (const float x : {1.3f, 1.7f, 2.0f, 2.5f, 2.8f})
    EXPECT_NEAR(at(thin, {x, 0, 0}), rod, 0.1f) << x;
  // The cube's edges and corners are no thin parts.
  for (const Vec3 p : {Vec3{0, 0, 0}, Vec3{-1, 0, 0}, Vec3{-1, 1, 0}, Vec3{-1, 1, 1},
                       Vec3{0, -1, -1}, Vec3{0.5f, 1, 0}})
    EXPECT_EQ(at(thin, p), 0) << p.x << " " << p.y << " " << p.z;
}

TEST(Thinness, FallsByOneOverATenthOfTheSize) {
  const DistanceGrid thin = compute_thinness(cube_with_rod(0.02f), kRodSize);
  const float rod = at(thin, {2, 0, 0});
  for (const float away : {0.1f, 0.2f, 0.3f})
    EXPECT_NEAR(at(thin, {2, away, 0}), rod - away / 0.4f, 0.12f) << away;
  EXPECT_EQ(at(thin, {2, 0.6f, 0}), 0);
  // In the cube, before the rod's root.
  EXPECT_GT(at(thin, {0.9f, 0, 0}), 0.4f);
  EXPECT_EQ(at(thin, {0.4f, 0, 0}), 0);
}

TEST(Thinness, OfAPlateIsLimited) {
  DistanceGrid plate;
  plate.grid = {{-1.2f, -0.2f, -1.2f}, 0.02f, {121, 21, 121}};
  for (int z = 0; z < 121; ++z)
    for (int y = 0; y < 21; ++y)
      for (int x = 0; x < 121; ++x)
        plate.values.push_back(
            box_distance(grid_point(plate.grid, {x, y, z}), {0, 0, 0}, {1, 0.06f, 1}));
  const DistanceGrid whole = compute_thinness(plate, 2.83f), thin = limit_thinness(whole, plate);
  // 1 - (0.06 / 0.17)^2 in the middle, so that hardly more than an eighth of it is no thin part.
  EXPECT_NEAR(at(whole, {0, 0, 0}), 0.875f, 0.1f);
  EXPECT_LT(at(thin, {0, 0, 0}), 0.6f * at(whole, {0, 0, 0}));
  EXPECT_GT(at(thin, {0, 0, 0}), 0.1f);
}

TEST(Thinness, OfARodOnACubeIsNotLimited) {
  const DistanceGrid object = cube_with_rod(0.02f), thin = compute_thinness(object, kRodSize);
  EXPECT_EQ(limit_thinness(thin, object).values, thin.values);
}

TEST(Thinness, HardlyDependsOnTheCells) {
  const DistanceGrid fine = compute_thinness(cube_with_rod(0.02f), kRodSize),
                     coarse = compute_thinness(cube_with_rod(0.04f), kRodSize);
  for (float x = -1; x < 3; x += 0.1f)
    for (float y = 0; y < 0.5f; y += 0.1f)
      EXPECT_NEAR(at(fine, {x, y, 0}), at(coarse, {x, y, 0}), 0.25f) << x << " " << y;
}

}  // namespace
}  // namespace polymorph
