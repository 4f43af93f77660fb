#include "field/remove_detail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/array3.h"
#include "field/thinness.h"
#include "testing/field.h"

namespace polymorph {
namespace {

constexpr float kBodySize = 4;  // of a body of radius 1 with a limb from x = 1 to x = 3

/// A body with 24 furrows, 0.065 of the size apart and 0.06 deep, and a limb of radius 0.15.
float distance(Vec3 p) {
  const float body = 1 + 0.03f * std::cos(24 * std::atan2(p.y, p.z)) - length(p);
  const Vec3 from_limb = p - Vec3{std::clamp(p.x, 0.0f, 2.85f), 0, 0};
  return std::max(body, 0.15f - length(from_limb));
}

struct Object {
  DistanceGrid distances;
  SmoothDistances spline;
};
Object make_object(float cell) {
  Object object;
  const Grid coarse = {{-1.6f, -1.6f, -1.6f},
                       4 * cell,
                       {static_cast<int>(5.2f / (4 * cell)), static_cast<int>(3.2f / (4 * cell)),
                        static_cast<int>(3.2f / (4 * cell))}};
  object.spline.grid = coarse;
  object.distances.grid = {
      coarse.origin,
      cell,
      {4 * coarse.points.x - 3, 4 * coarse.points.y - 3, 4 * coarse.points.z - 3}};
  const auto fill = [](const Grid& grid, std::vector<float>& values) {
    for (int z = 0; z < grid.points.z; ++z)
      for (int y = 0; y < grid.points.y; ++y)
        for (int x = 0; x < grid.points.x; ++x)
          values.push_back(distance(grid_point(grid, {x, y, z})));
  };
  fill(coarse, object.spline.values);
  fill(object.distances.grid, object.distances.values);
  close_border(object.distances);
  set_lipschitz(object.distances);
  return object;
}

TEST(RemoveDetail, TakesFurrowsFromTheBodyAndLeavesTheLimb) {
  const Object object = make_object(0.025f);
  const DistanceGrid thinness = compute_thinness(object.distances, kBodySize);
  const DistanceGrid smooth = remove_detail(object.distances, object.spline, thinness, kBodySize);
  const auto depth = [](const DistanceGrid& distances) {
    const float half = 3.14159265f / 24;
    return at(distances, {-0.2f, 0, 0.97f}) -
           at(distances, {-0.2f, 0.97f * std::sin(half), 0.97f * std::cos(half)});
  };
  EXPECT_NEAR(depth(object.distances), 0.06f, 0.01f);
  EXPECT_LT(depth(smooth), 0.02f);
  EXPECT_GT(at(smooth, {-0.9f, 0, 0}), 0) << "the body stays";
  EXPECT_LT(at(smooth, {-1.1f, 0, 0}), 0);
  for (const float x : {1.6f, 2.0f, 2.5f}) {
    EXPECT_GT(at(smooth, {x, 0.1f, 0}), 0) << "the limb stays at " << x;
    EXPECT_LT(at(smooth, {x, 0.2f, 0}), 0);
  }
  EXPECT_LE(smooth.lipschitz, object.distances.lipschitz + 0.1f);
}

TEST(RemoveDetail, MixesByTheThinnessAtEveryPoint) {
  const Object object = make_object(0.05f);
  const Grid& grid = object.distances.grid;
  // Thin points in two far corners, on cells that are no multiple of the distances' cells.
  DistanceGrid thinness{{grid.origin - Vec3{0.3f, 0.3f, 0.3f}, 0.13f, {47, 30, 30}}, {}, 1};
  thinness.values.assign(array3_count(thinness.grid.points), 0.0f);
  const DistanceGrid smooth = remove_detail(object.distances, object.spline, thinness, kBodySize);
  for (const Int3 thin : {Int3{5, 4, 6}, Int3{6, 4, 6}, Int3{36, 22, 20}})
    thinness.values[array3_index(thinness.grid.points, thin.x, thin.y, thin.z)] = 0.4f;
  const DistanceGrid mixed = remove_detail(object.distances, object.spline, thinness, kBodySize);
  int thin_count = 0;
  for (int z = 1; z + 1 < grid.points.z; ++z)
    for (int y = 1; y + 1 < grid.points.y; ++y)
      for (int x = 1; x + 1 < grid.points.x; ++x) {
        const std::size_t i = array3_index(grid.points, x, y, z);
        const float weight = std::clamp(2 * at(thinness, grid_point(grid, {x, y, z})), 0.0f, 1.0f);
        thin_count += weight > 0;
        const float expected =
            smooth.values[i] + weight * (object.distances.values[i] - smooth.values[i]);
        ASSERT_NEAR(mixed.values[i], expected, 1e-5f) << x << " " << y << " " << z;
      }
  EXPECT_GT(thin_count, 100);
}

TEST(RemoveDetail, HardlyDependsOnTheCells) {
  const auto smoothed = [](float cell) {
    const Object object = make_object(cell);
    return remove_detail(object.distances, object.spline,
                         compute_thinness(object.distances, kBodySize), kBodySize);
  };
  const DistanceGrid fine = smoothed(0.02f), coarse = smoothed(0.04f);
  const float furrow = at(make_object(0.02f).distances, {-0.2f, 0, 0.97f});
  EXPECT_LT(at(fine, {-0.2f, 0, 0.97f}), furrow - 0.015f);
  EXPECT_LT(at(coarse, {-0.2f, 0, 0.97f}), furrow - 0.015f);
  for (float x = -1.2f; x < 3; x += 0.1f)
    for (float y = 0; y < 1; y += 0.1f)
      EXPECT_NEAR(at(fine, {x, y, 0}), at(coarse, {x, y, 0}), 0.04f) << x << " " << y;
}

}  // namespace
}  // namespace polymorph
