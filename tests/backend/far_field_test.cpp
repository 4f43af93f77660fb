// The polynomial for distant balls: what it is exact for, and how far off it is.
#include "kernels/far_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace polymorph {
namespace {

const FarBox kBox(Vec3{-1, 2, 0.5f}, Vec3{3, 3, 0.75f});

template <class F>
FarField sampled(const F& f) {
  FarField far = {};
  for (int i = 0; i < kFarPoints; ++i) {
    far.value[i] = f(kBox.middle.x + kBox.half.x * far_point(i % 4),
                     kBox.middle.y + kBox.half.y * far_point(i / 4 % 4),
                     kBox.middle.z + kBox.half.z * far_point(i / 16));
  }
  return far;
}

std::vector<Vec3> points_in_box(int count) {
  std::mt19937 random(3);
  const auto unit = [&random] { return static_cast<float>(random() >> 8) * 0x1p-23f - 1; };
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i)
    points.push_back(kBox.middle + kBox.half * Vec3{unit(), unit(), unit()});
  return points;
}

float value_at(const FarField& far, Vec3 p) {
  const Vec3 s = (p - kBox.middle) * kBox.inverse;
  return far_value(far.value, s.x, s.y, s.z);
}

TEST(FarField, is_exact_for_third_degree_along_each_axis) {
  const auto f = [](float x, float y, float z) {
    return 1 + x * x * x - 2 * y * y * y * x + 3 * x * x * y * z * z * z;
  };
  const FarField far = sampled(f);
  for (const Vec3 p : points_in_box(200)) {
    ASSERT_NEAR(value_at(far, p), f(p.x, p.y, p.z), 1e-3f);
    const FarSlope<float> slope(far.value, kBox, p.x, p.y, p.z);
    ASSERT_NEAR(slope.value, f(p.x, p.y, p.z), 1e-3f);
    ASSERT_NEAR(slope.x, 3 * p.x * p.x - 2 * p.y * p.y * p.y + 6 * p.x * p.y * p.z * p.z * p.z,
                3e-3f);
    ASSERT_NEAR(slope.y, -6 * p.y * p.y * p.x + 3 * p.x * p.x * p.z * p.z * p.z, 3e-3f);
    ASSERT_NEAR(slope.z, 9 * p.x * p.x * p.y * p.z * p.z, 3e-2f);
  }
}

TEST(FarField, rows_are_the_values_at_their_points) {
  const FarField far = sampled([](float x, float y, float z) { return x * y * y + z; });
  for (const Vec3 p : points_in_box(50)) {
    const float y[2] = {p.y, kBox.middle.y};
    float rows[2];
    far_rows(far.value, kBox, p.x, y, p.z, rows);
    ASSERT_NEAR(rows[0], value_at(far, p), 1e-5f);
    ASSERT_NEAR(rows[1], value_at(far, {p.x, y[1], p.z}), 1e-5f);
  }
}

/// The stated bound, kFarError a^4 / near^3 with near the least squared distance, holds for balls
/// in every direction, and is no more than twenty times the worst error: it is of the right
/// order.
TEST(FarField, is_off_by_no_more_than_its_bound) {
  const FarBox cube({-1, -1, -1}, {1, 1, 1});
  std::mt19937 random(5);
  const auto unit = [&random] { return static_cast<double>(random() >> 8) * 0x1p-23 - 1; };
  for (const double reach : {2.0, 3.0, 6.0}) {
    double worst = 0;
    for (int ball = 0; ball < 300; ++ball) {
      double c[3] = {unit(), unit(), unit()};
      c[ball % 3] = ball % 2 == 0 ? 1 + reach : -1 - reach;
      if (ball >= 150) c[(ball + 1) % 3] *= 1 + reach;  // off the faces too
      double near = 0;
      for (const double a : c) near += std::pow(std::max(std::abs(a) - 1, 0.0), 2);
      const auto field = [&](double x, double y, double z) {
        return 1 / ((x - c[0]) * (x - c[0]) + (y - c[1]) * (y - c[1]) + (z - c[2]) * (z - c[2]));
      };
      FarField far = {};
      for (int i = 0; i < kFarPoints; ++i) {
        const auto at = [](int n) { return static_cast<double>(far_point(n)); };
        far.value[i] = static_cast<float>(field(at(i % 4), at(i / 4 % 4), at(i / 16)));
      }
      for (int i = 0; i < 7 * 7 * 7; ++i) {
        const float x = static_cast<float>(i % 7) / 3 - 1,
                    y = static_cast<float>(i / 7 % 7) / 3 - 1,
                    z = static_cast<float>(i / 49) / 3 - 1;
        const double exact =
            field(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
        const double off = std::abs(static_cast<double>(far_value(far.value, x, y, z)) - exact);
        const double rounding = 1200 * 0x1p-24 / near;
        const double bound = static_cast<double>(kFarError) / (near * near * near);
        ASSERT_LE(off, bound + rounding);
        worst = std::max(worst, off / bound);
      }
    }
    EXPECT_GT(worst, 0.05) << "at " << reach;
  }
}

}  // namespace
}  // namespace polymorph
