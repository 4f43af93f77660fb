#include "mesh/crossings.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "mesh/closest.h"
#include "mesh/inside.h"
#include "testing/model.h"

namespace polymorph {
namespace {

Vec3 along(int axis, float length) {
  return axis == 0 ? Vec3{length, 0, 0} : axis == 1 ? Vec3{0, length, 0} : Vec3{0, 0, length};
}

std::optional<int> entries(const Model& model, Vec3 from, int axis, float length) {
  const ClosestPointQuery closest(model);
  std::vector<TriangleBvh::Corners> triangles;
  list_triangles(closest.view(), {from, from + along(axis, length)}, triangles);
  return count_entries(triangles, from, axis, static_cast<double>(length));
}

TEST(Crossings, AWayThroughABoxEntersAndLeavesIt) {
  const Model box = box_model({0, 0, 0}, {1, 1, 1});
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 before = Vec3{0.3f, 0.4f, 0.6f} - along(axis, 1);
    EXPECT_EQ(entries(box, before, axis, 0.1f), 0);
    EXPECT_EQ(entries(box, before, axis, 1), 1);
    EXPECT_EQ(entries(box, before, axis, 3), 0);
    EXPECT_EQ(entries(box, before + along(axis, 1), axis, 3), -1);
  }
}

TEST(Crossings, DecidesNothingAtEdgesAndAtEndsOnATriangle) {
  const Model box = box_model({0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(entries(box, {-1, 0, 0.5f}, 0, 1.5f), std::nullopt) << "along a side";
  EXPECT_EQ(entries(box, {-1, 0.5f, 0.5f}, 0, 1.5f), std::nullopt) << "through a diagonal";
  EXPECT_EQ(entries(box, {-1, 0.4f, 0.7f}, 0, 1), std::nullopt) << "ends on a side";
  EXPECT_EQ(entries(box, {0, 0.4f, 0.7f}, 0, 0.5f), std::nullopt) << "begins on a side";
  EXPECT_EQ(entries(box, {-1, 0.4f, 0.7f}, 0, 0.5f), 0);
}

/// Also where components overlap and where one faces inward.
TEST(Crossings, AreDifferencesOfWindingNumbers) {
  Model model = box_model({-1, -1, -1}, {0.31f, 0.77f, 0.9f});
  add_box(model, {-0.4f, -0.5f, -0.6f}, {1, 1, 1});
  add_box(model, {-0.1f, -0.2f, -0.3f}, {0.2f, 0.25f, 0.4f}, /*inverted=*/true);
  const InsideTest inside(model);
  const ClosestPointQuery closest(model);
  std::vector<TriangleBvh::Corners> triangles;
  int decided = 0, crossed = 0;
  for (std::size_t i = 0; i < 3000; ++i) {
    const auto [x, y, z] = r3_point(i);
    const Vec3 p = to_float(Vec3d(x, y, z) * 2.4) - Vec3{1.2f, 1.2f, 1.2f};
    const int axis = static_cast<int>(i % 3);
    const float length = 0.3f;
    const Vec3 q = p + along(axis, length);
    list_triangles(closest.view(), {p, q}, triangles);
    const auto count = count_entries(triangles, p, axis, static_cast<double>(length));
    if (!count) continue;
    ++decided;
    crossed += *count != 0 ? 1 : 0;
    EXPECT_EQ(*count, std::lround(inside.winding_number(q) - inside.winding_number(p))) << i;
  }
  EXPECT_GT(decided, 2990);
  EXPECT_GT(crossed, 500);
}

}  // namespace
}  // namespace polymorph
