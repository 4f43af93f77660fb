#include "morph/passing_limbs.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "morph/motion.h"
#include "testing/morph.h"

namespace polymorph {
namespace {

constexpr float kSize = 2;

std::vector<float> shares_at(const MorphPlan& plan, float time) {
  return passing_weights(plan, eased_times(plan, time), BallSet(balls_at(plan, time)), kSize);
}

float largest_at(const MorphPlan& plan, float time) {
  const std::vector<float> shares = shares_at(plan, time);
  return *std::max_element(shares.begin(), shares.end());
}

TEST(PassingLimbs, PassHalfWayAndNotAtTheEnds) {
  const MorphPlan plan = plan_between_columns(0.4f);
  EXPECT_EQ(largest_at(plan, 0), 0);
  EXPECT_EQ(largest_at(plan, 1), 0);
  for (const float share : shares_at(plan, 0.5f)) EXPECT_EQ(share, 1);
  const float before = largest_at(plan, 0.3f);
  EXPECT_GT(before, 0);
  EXPECT_LT(before, 1);
  EXPECT_NEAR(largest_at(plan, 0.7f), before, 1e-4f);
}

TEST(PassingLimbs, StandingBesideEachOtherIsNotPassing) {
  const MorphPlan plan = plan_between_columns(0);
  for (const float time : {0.0f, 0.25f, 0.5f, 1.0f}) EXPECT_LT(largest_at(plan, time), 1e-5f);
}

TEST(PassingLimbs, OfTheSameLimbOrOfNoneNothingPasses) {
  MorphPlan plan = plan_between_columns(0.4f);
  std::fill(plan.from_limbs.begin(), plan.from_limbs.end(), 0);
  plan.to_limbs = plan.from_limbs;
  EXPECT_EQ(largest_at(plan, 0.5f), 0);
  plan.from_limbs.clear(), plan.to_limbs.clear();
  EXPECT_EQ(largest_at(plan, 0.5f), 0);
}

TEST(PassingLimbs, FarFromEachOtherAreNotMixedAnyway) {
  // Limbs 0.2 apart are beyond reach of objects a tenth as large.
  const MorphPlan plan = plan_between_columns(0.4f);
  const std::vector<float> shares =
      passing_weights(plan, eased_times(plan, 0.5f), BallSet(balls_at(plan, 0.5f)), 0.1f * kSize);
  EXPECT_EQ(*std::max_element(shares.begin(), shares.end()), 0);
}

}  // namespace
}  // namespace polymorph
