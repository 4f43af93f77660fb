#include "morph/plan_words.h"

#include <gtest/gtest.h>

#include "base/exact_math.h"

namespace polymorph {
namespace {

TEST(PlanWords, SayTheTurn) {
  MorphPlan plan;
  EXPECT_EQ(describe_rotation(plan), "");
  plan.alignment.rotation_vector = {0, -exact::kPi / 2, 0};
  EXPECT_EQ(describe_rotation(plan), "turns by 90 degrees about the vertical");
  plan.alignment.rotation_vector = {0.5, 0.5, 0};
  EXPECT_EQ(describe_rotation(plan), "turns by 41 degrees about a tilted axis (see plan.align)");
  plan.motion.path = Path::kStraight;
  EXPECT_EQ(describe_rotation(plan), "");
}

TEST(PlanWords, SayTheLimbs) {
  MorphPlan plan;
  EXPECT_EQ(describe_limbs(plan), "");
  plan.limb_names = {{"head", "head"}, {"tail", ""}, {"", "left arm"}};
  EXPECT_EQ(describe_limbs(plan), "head -> head, tail -> nothing, nothing -> left arm");
}

}  // namespace
}  // namespace polymorph
