#include "kernels/math.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "kernels/falloff.h"

namespace polymorph {
namespace {

TEST(Math, power_of_two_is_within_1_5e_7) {
  double worst = 0;
  for (int i = 0; i <= 2250000; ++i) {
    const float e = kSmallestExponent + static_cast<float>(i) * 1e-4f;
    const double exact = std::exp2(static_cast<double>(e));
    worst = std::max(worst, std::fabs(static_cast<double>(power_of_two(e)) / exact - 1));
  }
  EXPECT_LT(worst, 1.5e-7);
  RecordProperty("worst", std::to_string(worst));
}

TEST(Math, power_of_two_is_exact_for_whole_exponents) {
  for (int e = -125; e <= 100; ++e) {
    EXPECT_EQ(power_of_two(static_cast<float>(e)), std::ldexp(1.0f, e)) << e;
  }
}

TEST(Math, log_of_two_is_within_2e_7) {
  double worst = 0;
  for (int i = 0; i < 2000000; ++i) {
    const float a = std::ldexp(1.0f + static_cast<float>(i % 8191) / 8191.0f, i % 240 - 120);
    const double exact = std::log2(static_cast<double>(a));
    const double error = std::fabs(static_cast<double>(log_of_two(a)) - exact);
    worst = std::max(worst, error / std::max(1.0, std::fabs(exact)));
  }
  EXPECT_LT(worst, 2e-7);
  EXPECT_EQ(log_of_two(1.0f), 0.0f);
  EXPECT_EQ(log_of_two(0.125f), -3.0f);
}

TEST(Math, branchless_selections_agree_with_comparisons) {
  const float values[] = {-2.5f, -0.0f, 0.0f, 1e-30f, 3.0f, 1e30f};
  for (const float a : values) {
    for (const float b : values) {
      EXPECT_EQ(least(a, b), std::fmin(a, b));
      EXPECT_EQ(most(a, b), std::fmax(a, b));
    }
    EXPECT_EQ(float_bits(kept_if(false, a)), 0u);
    EXPECT_EQ(float_bits(kept_if(true, a)), float_bits(a));
  }
  EXPECT_EQ(float_bits(kept_if(false, std::numeric_limits<float>::quiet_NaN())), 0u);
}

TEST(Falloff, gaussian_is_blinns_and_exactly_zero_beyond_reach) {
  const Ball ball = {{0, 0, 0}, 4.0f / (0.3f * 0.3f), 4.0f};
  const PreparedBall p = prepare_ball<FieldKind::kGaussian>(ball, std::log2(1e-4f));
  EXPECT_NEAR(falloff<FieldKind::kGaussian>(p, 0.09f), 1.0f, 1e-6f);
  // Reach: r = R sqrt(1 + ln(1 / cutoff) / B).
  const float reach2 = 0.09f * (1 + std::log(1e4f) / 4);
  EXPECT_NEAR(p.reach2, reach2, 1e-6f);
  EXPECT_NEAR(falloff<FieldKind::kGaussian>(p, reach2 * 0.9999f), 1e-4f, 1e-6f);
  EXPECT_EQ(float_bits(falloff<FieldKind::kGaussian>(p, reach2 * 1.0001f)), 0u);
  EXPECT_EQ(float_bits(falloff<FieldKind::kGaussian>(p, 1e30f)), 0u);
  EXPECT_EQ(float_bits(falloff<FieldKind::kGaussian>(p, std::numeric_limits<float>::infinity())),
            0u);
}

TEST(Falloff, a_ball_below_the_cutoff_contributes_nowhere) {
  const PreparedBall p = prepare_ball<FieldKind::kGaussian>({{0, 0, 0}, 1, -20}, std::log2(1e-4f));
  EXPECT_EQ(falloff<FieldKind::kGaussian>(p, 0.0f), 0.0f);
}

TEST(Falloff, a_very_strong_ball_stays_finite) {
  const PreparedBall p = prepare_ball<FieldKind::kGaussian>({{0, 0, 0}, 1, 1000}, std::log2(1e-4f));
  EXPECT_EQ(falloff<FieldKind::kGaussian>(p, 0.0f), std::ldexp(1.0f, 100));
}

TEST(Falloff, inverse_square_is_finite_at_the_center) {
  const PreparedBall p = prepare_ball<FieldKind::kInverseSquare>({{0, 0, 0}, 1, 0.25f}, 0);
  EXPECT_TRUE(std::isfinite(falloff<FieldKind::kInverseSquare>(p, 0.0f)));
  EXPECT_FLOAT_EQ(falloff<FieldKind::kInverseSquare>(p, 0.25f), 1.0f);
}

}  // namespace
}  // namespace polymorph
