#include "mesh/solid_angle.h"

#include <gtest/gtest.h>

#include <cmath>

namespace polymorph {
namespace {

TEST(AngleSums, AddThoseThatAreTaken) {
  AngleSums::Triangles triangles{};
  const Vec3d eye(0.1, -0.2, 0.3);
  double expected[2] = {};
  constexpr unsigned kTaken = 0b10110101;
  for (int k = 0; k < AngleSums::kLanes; ++k) {
    Vec3d corners[3];
    for (int i = 0; i < 9; ++i) {
      const auto number = static_cast<float>(std::sin(1.7 * (9 * k + i) + 0.3));
      triangles.corner[i][k] = number;
      (i % 3 == 0   ? corners[i / 3].x
       : i % 3 == 1 ? corners[i / 3].y
                    : corners[i / 3].z) = static_cast<double>(number);
    }
    const HalfAngle half = half_solid_angle(corners[0] - eye, corners[1] - eye, corners[2] - eye);
    const double angle = std::atan2(half.num, half.den);
    expected[0] += angle;
    if (kTaken >> k & 1u) expected[1] += angle;
  }
  AngleSums all, taken;
  const AngleSums::Angles angles = AngleSums::angles(triangles, eye);
  for (int i = 0; i < 300; ++i) {  // beyond what a product's size may be
    all.add(triangles, eye);
    taken.add(angles, kTaken);
  }
  EXPECT_NEAR(all.sum(), 300 * expected[0], 1e-9);
  EXPECT_NEAR(taken.sum(), 300 * expected[1], 1e-9);
  EXPECT_GT(std::abs(expected[1] - expected[0]), 0.01);
}

}  // namespace
}  // namespace polymorph
