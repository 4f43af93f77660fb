#include "mesh/winding_slope.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/exact_math.h"
#include "base/random.h"
#include "mesh/closest.h"
#include "mesh/solid_angle.h"
#include "testing/model.h"

namespace polymorph {
namespace {

/// A sphere without the cap above `height`, of radius 1.
Model cut_sphere(double height) {
  std::vector<Vec2> profile;
  for (int k = 0; k <= 24; ++k) {
    const double y = -1 + (height + 1) * k / 24;
    profile.push_back(
        {static_cast<float>(std::sqrt(std::max(1 - y * y, 0.0))), static_cast<float>(y)});
  }
  return lathe(profile);
}

/// The sum of all triangles' solid angles over 4 pi.
double exact_winding_number(const Model& model, Vec3 p) {
  double sum = 0;
  for (const Triangle& t : model.triangles) {
    const auto corner = [&](int k) { return Vec3d(model.points[t.v[k]]) - Vec3d(p); };
    const HalfAngle angle = half_solid_angle(corner(0), corner(1), corner(2));
    sum += std::atan2(angle.num, angle.den);
  }
  return sum / (2 * exact::kPi);
}

TEST(WindingSlope, AClosedMeshHasNoOpenEdges) {
  const OpenEdges edges = find_open_edges(box_model({0, 0, 0}, {1, 1, 1}));
  EXPECT_EQ(edges.count, 0u);
  EXPECT_EQ(max_winding_slope(edges, {0.5f, 0.5f, 0.5f}, 2), 0);
}

TEST(WindingSlope, TheRimOfAHoleIsOpen) {
  const OpenEdges edges = find_open_edges(cut_sphere(0.8));
  EXPECT_EQ(edges.count, 64u);
  // A circle of radius 0.6 seen from its centre, at the distance of its edges' ends.
  const float length = 2 * static_cast<float>(exact::kPi) * 0.6f;
  const float slope = length / (4 * static_cast<float>(exact::kPi) * 0.36f);
  EXPECT_NEAR(max_winding_slope(edges, {0, 0.8f, 0}, 0), slope, 0.15f * slope);
  EXPECT_TRUE(std::isinf(max_winding_slope(edges, {0.6f, 0.8f, 0}, 0)));
  EXPECT_TRUE(std::isinf(max_winding_slope(edges, {0, 0.8f, 0}, 0.61f)));
}

/// A triangle that is there twice has edges of which both count.
TEST(WindingSlope, CountsEachTraversal) {
  Model once;
  once.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  once.triangles = {{{0, 1, 2}}};
  Model twice = once;
  twice.triangles.push_back({{0, 1, 2}});
  const Vec3 p{0.3f, 0.3f, 2};
  EXPECT_FLOAT_EQ(max_winding_slope(find_open_edges(twice), p, 0.1f),
                  2 * max_winding_slope(find_open_edges(once), p, 0.1f));
}

TEST(WindingSlope, BoundsTheChangeOfWindingNumbers) {
  const Model model = cut_sphere(0.8);
  const OpenEdges edges = find_open_edges(model);
  const ClosestPointQuery closest(model);
  int compared = 0;
  double largest = 0;  // share of the bound
  for (std::size_t i = 0; i < 400; ++i) {
    const auto [x, y, z] = r3_point(i);
    const Vec3 p = to_float(Vec3d(x, y, z) * 3.0) - Vec3{1.5f, 1.5f, 1.5f};
    const float step = 0.05f;
    if (closest.closest(p).distance < 1.1f * step) continue;  // a face may lie between
    const Vec3 q = p + Vec3{0, step, 0}, middle = p + Vec3{0, 0.5f * step, 0};
    const double bound = static_cast<double>(step * max_winding_slope(edges, middle, 0.5f * step));
    const double change = std::abs(exact_winding_number(model, p) - exact_winding_number(model, q));
    EXPECT_LE(change, bound + 1e-6) << i;
    largest = std::max(largest, change / bound);
    ++compared;
  }
  EXPECT_GT(compared, 300);
  EXPECT_GT(largest, 0.1) << "the bound is of use";
}

}  // namespace
}  // namespace polymorph
