#include "analyze/distortion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/matrix_decompositions.h"
#include "testing/model.h"

namespace polymorph {
namespace {

Model square() {
  Model model;
  model.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  model.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
  return model;
}

Model moved(Model model, const Mat3& by) {
  for (Vec3& p : model.points) p = to_float(by * Vec3d(p) + Vec3d{1, 2, 3});
  return model;
}

TEST(ConformalDistortion, IsOneWhereOnlySizeAndPlaceChange) {
  const Model box = box_model({0, 0, 0}, {1, 2, 3});
  Mat3 by = exp_rotation({0.3, 0.4, -0.2});
  for (double& value : by.m) value *= 2.5;
  EXPECT_NEAR(conformal_distortion(box, moved(box, by)), 1, 1e-3);
  EXPECT_NEAR(conformal_distortion(box, box), 1, 1e-12);
}

TEST(ConformalDistortion, IsTheQuotientOfBothStretches) {
  EXPECT_NEAR(conformal_distortion(square(), moved(square(), {{6, 0, 0, 0, 2, 0, 0, 0, 1}})), 3,
              1e-5);
  // A shear by one has the singular values of the golden ratio and its inverse.
  const double golden = (1 + std::sqrt(5.0)) / 2;
  const Model sheared = moved(square(), {{1, 1, 0, 0, 1, 0, 0, 0, 1}});
  EXPECT_NEAR(conformal_distortion(square(), sheared), golden * golden, 1e-5);
  EXPECT_NEAR(conformal_distortion(sheared, square()), golden * golden, 1e-5);
}

TEST(ConformalDistortion, WeighsTrianglesByBothAreas) {
  // One triangle collapses (100 at most), the other doubles along x: half of the area before and
  // nothing of it after against half and all.
  Model after = square();
  after.points = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 0.5f, 0}};
  EXPECT_NEAR(conformal_distortion(square(), after), 0.75 * 2 + 0.25 * 100, 1e-5);
  EXPECT_EQ(conformal_distortion(Model{}, Model{}), 0);
}

TEST(Corresponds, NeedsTheSameTrianglesWhicheverWayTheyTurn) {
  Model other = square();
  EXPECT_TRUE(corresponds(square(), moved(other, {})));
  other.triangles[0] = {{1, 0, 2}};
  EXPECT_TRUE(corresponds(square(), other));
  other.triangles[0] = {{0, 1, 3}};
  EXPECT_FALSE(corresponds(square(), other));
  other = square();
  other.points.push_back({});
  EXPECT_FALSE(corresponds(square(), other));
}

}  // namespace
}  // namespace polymorph
