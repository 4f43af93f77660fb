#include "morph/plan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace polymorph {
namespace {

std::vector<Ball> random_balls(int n, std::uint64_t seed, Vec3 shift = {}) {
  std::vector<Ball> balls;
  for (int i = 0; i < n; ++i) {
    const auto r = [&](std::uint64_t k) {
      return random_float(seed, k, static_cast<std::uint64_t>(i));
    };
    balls.push_back({Vec3{r(0), r(1), r(2)} + shift, 5 + 20 * r(3), 1 + r(4)});
  }
  return balls;
}

double field(const std::vector<Ball>& balls, Vec3 p, FieldKind kind) {
  double sum = 0;
  for (const Ball& b : balls) {
    const Vec3 d = p - b.center;
    const double r2 = static_cast<double>(dot(d, d));
    sum += kind == FieldKind::kGaussian
               ? std::exp(static_cast<double>(b.w) - static_cast<double>(b.a) * r2)
               : static_cast<double>(b.w) / r2;
  }
  return sum;
}

class PlanTest : public ::testing::TestWithParam<PlanMethod> {};

TEST_P(PlanTest, SharesOfEveryBallSumToOneOnBothSides) {
  for (const auto& [n, m] : {std::pair{40, 40}, {7, 90}, {90, 7}, {1, 5}, {5, 1}, {1, 1}}) {
    const MorphPlan plan =
        plan_morph(random_balls(n, 1), random_balls(m, 2), FieldKind::kGaussian, {GetParam(), 3});
    std::vector<double> from(static_cast<std::size_t>(n)), to(static_cast<std::size_t>(m));
    for (const Pair& pair : plan.pairs) {
      EXPECT_GT(pair.from_share, 0);
      EXPECT_GT(pair.to_share, 0);
      from.at(pair.from) += static_cast<double>(pair.from_share);
      to.at(pair.to) += static_cast<double>(pair.to_share);
    }
    for (const double share : from) EXPECT_NEAR(share, 1, 1e-5);
    for (const double share : to) EXPECT_NEAR(share, 1, 1e-5);
    EXPECT_LE(plan.pairs.size(), static_cast<std::size_t>(2 * (n + m)));
  }
}

TEST_P(PlanTest, TheEndsAreTheObjectsOwnFields) {
  for (const FieldKind kind : {FieldKind::kGaussian, FieldKind::kInverseSquare}) {
    const auto a = random_balls(30, 1), b = random_balls(50, 2, {2, 0, 0});
    const MorphPlan plan = plan_morph(a, b, kind, {GetParam(), 0});
    for (int i = 0; i < 40; ++i) {
      const Vec3 p{random_float(9, 0, static_cast<std::uint64_t>(i)) * 3,
                   random_float(9, 1, static_cast<std::uint64_t>(i)), 0.3f};
      EXPECT_NEAR(field(balls_at(plan, 0), p, kind) / field(a, p, kind), 1, 2e-5);
      EXPECT_NEAR(field(balls_at(plan, 1), p, kind) / field(b, p, kind), 1, 2e-5);
    }
  }
}

TEST_P(PlanTest, MotionIsContinuousAtTheEnds) {
  const MorphPlan plan =
      plan_morph(random_balls(30, 1), random_balls(50, 2), FieldKind::kGaussian, {GetParam(), 0});
  const auto at_zero = balls_at(plan, 0), near_zero = balls_at(plan, 1e-6f),
             at_one = balls_at(plan, 1), near_one = balls_at(plan, 1 - 1e-6f);
  for (std::size_t i = 0; i < at_zero.size(); ++i) {
    EXPECT_NEAR(near_zero[i].a / at_zero[i].a, 1, 1e-4);
    EXPECT_NEAR(near_one[i].a / at_one[i].a, 1, 1e-4);
    EXPECT_LT(length(near_zero[i].center - at_zero[i].center), 1e-4f);
    EXPECT_NEAR(near_one[i].w, at_one[i].w, 1e-4);
  }
}

TEST_P(PlanTest, IsTheSameEveryTime) {
  const auto plan = [] {
    return plan_morph(random_balls(60, 1), random_balls(45, 2), FieldKind::kGaussian,
                      {GetParam(), 11});
  };
  const MorphPlan one = plan(), two = plan();
  ASSERT_EQ(one.pairs.size(), two.pairs.size());
  for (std::size_t i = 0; i < one.pairs.size(); ++i) {
    EXPECT_EQ(one.pairs[i].from, two.pairs[i].from);
    EXPECT_EQ(one.pairs[i].to, two.pairs[i].to);
    EXPECT_EQ(one.pairs[i].from_share, two.pairs[i].from_share);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, PlanTest,
                         ::testing::Values(PlanMethod::kIndex, PlanMethod::kBisection),
                         [](const auto& method) {
                           return method.param == PlanMethod::kIndex ? "Index" : "Bisection";
                         });

TEST(IndexPlan, PairsInOrderAndDrawsTheSurplusBySeed) {
  const auto a = random_balls(3, 1), b = random_balls(8, 2);
  const MorphPlan plan = plan_morph(a, b, FieldKind::kGaussian, {PlanMethod::kIndex, 1});
  ASSERT_EQ(plan.pairs.size(), 8u);
  for (std::uint32_t i = 0; i < 8; ++i) EXPECT_EQ(plan.pairs[i].to, i);
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(plan.pairs[i].from, i);
  bool differs = false;
  const MorphPlan other = plan_morph(a, b, FieldKind::kGaussian, {PlanMethod::kIndex, 2});
  for (std::size_t i = 3; i < 8; ++i) {
    EXPECT_LT(plan.pairs[i].from, 3u);
    differs |= plan.pairs[i].from != other.pairs[i].from;
  }
  EXPECT_TRUE(differs);
}

TEST(BisectionPlan, ACopyIsPairedWithItself) {
  const auto a = random_balls(64, 1);
  auto b = a;
  for (Ball& ball : b) ball.center = ball.center + Vec3{3, 1, 0};
  const MorphPlan plan = plan_morph(a, b, FieldKind::kGaussian, {PlanMethod::kBisection, 0});
  for (const Pair& pair : plan.pairs) EXPECT_EQ(pair.from, pair.to);
  EXPECT_EQ(plan.pairs.size(), a.size());
}

TEST(BisectionPlan, MovesLessThanTheIndexPlanOnShuffledBalls) {
  const auto a = random_balls(200, 1), b = random_balls(150, 2);
  const auto cost = [&](PlanMethod method) {
    double sum = 0;
    const MorphPlan plan = plan_morph(a, b, FieldKind::kGaussian, {method, 0});
    for (const Pair& pair : plan.pairs)
      sum += static_cast<double>(pair.from_share *
                                 length(plan.from[pair.from].center - plan.to[pair.to].center));
    return sum / static_cast<double>(a.size());
  };
  EXPECT_LT(cost(PlanMethod::kBisection), 0.5 * cost(PlanMethod::kIndex));
}

TEST(Ease, RunsFromZeroToOneWithoutTurningBack) {
  for (const Easing easing : {Easing::kLinear, Easing::kSmoothstep, Easing::kQuintic}) {
    EXPECT_EQ(ease(easing, 0), 0);
    EXPECT_EQ(ease(easing, 1), 1);
    EXPECT_FLOAT_EQ(ease(easing, 0.5f), 0.5f);
    EXPECT_EQ(ease(easing, -1), 0);
    for (int i = 0; i < 100; ++i)
      EXPECT_LE(ease(easing, static_cast<float>(i) / 100),
                ease(easing, static_cast<float>(i + 1) / 100));
  }
}

}  // namespace
}  // namespace polymorph
