#include "morph/plan_cycle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "testing/morph.h"

namespace polymorph {
namespace {

/// Four balls of one mass at the corners of a square whose diagonals are 2.
std::vector<Ball> square() {
  return {ball_at({1, 0, 0}, 0.2f), ball_at({0, 1, 0}, 0.2f), ball_at({-1, 0, 0}, 0.2f),
          ball_at({0, -1, 0}, 0.2f)};
}

/// A plan from the square to itself, whose pairs are given as (from, to, share).
MorphPlan square_plan(std::vector<Pair> pairs) {
  MorphPlan plan;
  plan.from = plan.to = square();
  plan.from_masses = plan.to_masses = std::vector<double>(4, 0.25);
  plan.pairs = std::move(pairs);
  return plan;
}

/// Each ball becomes the one `steps` corners further.
MorphPlan rotated(std::uint32_t steps) {
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < 4; ++i) pairs.push_back({i, (i + steps) % 4});
  return square_plan(pairs);
}

TEST(PlanCycle, MassThatComesBackHasNoError) {
  const MorphPlan one = rotated(1), two = rotated(2);
  const auto error = cycle_error({&one, &one, &two});
  ASSERT_TRUE(error);
  EXPECT_DOUBLE_EQ(error->drift, 0);
  EXPECT_DOUBLE_EQ(error->spread, 0);
}

TEST(PlanCycle, DriftIsTheDistanceFromTheStart) {
  const MorphPlan one = rotated(1);
  const auto quarter = cycle_error({&one}), half = cycle_error({&one, &one});
  ASSERT_TRUE(quarter && half);
  EXPECT_NEAR(quarter->drift, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(half->drift, 2, 1e-12);
  EXPECT_NEAR(half->spread, 0, 1e-12);
}

TEST(PlanCycle, MassThatGoesEverywhereHasBothErrors) {
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < 16; ++i) pairs.push_back({i / 4, i % 4, 0.25f, 0.25f});
  const MorphPlan all = square_plan(pairs);
  const auto error = cycle_error({&all});
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->drift, 1, 1e-12);
  EXPECT_NEAR(error->spread, 1, 1e-12);
}

TEST(PlanCycle, OtherChainsAreNone) {
  EXPECT_FALSE(cycle_error({}));
  MorphPlan away = rotated(0);
  away.to[0].center = {1.5f, 0, 0};
  EXPECT_FALSE(cycle_error({&away}));
  MorphPlan fewer = rotated(0);
  fewer.from.pop_back();
  const MorphPlan same = rotated(0);
  EXPECT_FALSE(cycle_error({&same, &fewer}));
}

TEST(PlanCycle, APlanAndItsMirrorImageDoNotDrift) {
  PlanSide from, to;
  from.balls = bar();
  to.balls = moved(bar(), exp_rotation({0, 0.4, 0}), 1.2, {0.1, 0, 0});
  std::reverse(to.balls.begin(), to.balls.end());
  const MorphPlan there = plan_morph(from, to, FieldKind::kGaussian, {});
  const MorphPlan back = plan_morph(to, from, FieldKind::kGaussian, {});
  const auto error = cycle_error({&there, &back});
  ASSERT_TRUE(error);
  EXPECT_LT(error->drift, 0.1);
  EXPECT_LT(error->spread, 0.2);
}

}  // namespace
}  // namespace polymorph
