#include "morph/posed_plan.h"

#include <gtest/gtest.h>

#include "base/matrix_decompositions.h"
#include "morph/motion.h"
#include "testing/morph.h"

namespace polymorph {
namespace {

MorphPlan bar_plan(MotionSettings motion = {}) {
  PlanSide from, to;
  from.balls = bar();
  to.balls = moved(bar(), exp_rotation({0, 0.4, 0}), 1.2, {0.1, 0, 0});
  return plan_morph(from, to, FieldKind::kGaussian, {}, motion);
}

/// The balls, turned as a whole.
CarriedBalls turned(const std::vector<Ball>& balls, const Mat3& turn) {
  return {moved(balls, turn, 1, {}), std::vector<Mat3>(balls.size(), turn)};
}

TEST(PosedPlan, BothEndsAreTheBallsOfThePoses) {
  for (const Path path : {Path::kAuto, Path::kStraight, Path::kParts}) {
    MotionSettings motion;
    motion.path = path;
    const MorphPlan reference = bar_plan(motion);
    CarriedBalls from{reference.from, {}}, to = turned(reference.to, exp_rotation({0.2, 0, 0.1}));
    // The knob bends.
    for (std::size_t i = 17; i < 21; ++i)
      from.balls[i].center = from.balls[i].center + Vec3{0.1f, 0, 0.05f};
    const MorphPlan plan = posed_plan(reference, from, to);
    ASSERT_EQ(plan.pairs.size(), reference.pairs.size());
    const std::vector<Ball> first = balls_at(plan, 0), last = balls_at(plan, 1);
    for (std::size_t e = 0; e < plan.pairs.size(); ++e) {
      EXPECT_EQ(plan.pairs[e].from, reference.pairs[e].from);
      EXPECT_EQ(plan.pairs[e].to, reference.pairs[e].to);
      EXPECT_EQ(plan.paths->balls[e].part, reference.paths->balls[e].part);
      EXPECT_LT(length(first[e].center - from.balls[plan.pairs[e].from].center), 1e-5f);
      EXPECT_LT(length(last[e].center - to.balls[plan.pairs[e].to].center), 1e-5f);
    }
  }
}

TEST(PosedPlan, ItTurnsWithItsObjects) {
  MorphPlan reference = bar_plan();
  reference.from_offsets.assign(reference.pairs.size(), {0, 0, 0.1f});
  reference.to_offsets.assign(reference.pairs.size(), {0.2f, 0, 0});
  const Mat3 turn = exp_rotation({0, 0.7, 0});
  const MorphPlan plan =
      posed_plan(reference, turned(reference.from, turn), turned(reference.to, turn));
  // What happens is the same, turned as a whole.
  for (const float time : {0.25f, 0.5f, 0.75f}) {
    const std::vector<Ball> before = moved(balls_at(reference, time), turn, 1, {}),
                            after = balls_at(plan, time);
    for (std::size_t e = 0; e < before.size(); ++e)
      EXPECT_LT(length(before[e].center - after[e].center), 1e-4f) << time << " " << e;
  }
  EXPECT_LT(length(plan.from_offsets[0] - to_float(turn * Vec3d{0, 0, 0.1})), 1e-6f);
  EXPECT_LT(length(plan.to_offsets[0] - to_float(turn * Vec3d{0.2, 0, 0})), 1e-6f);
}

TEST(PosedPlan, TheReferencePoseIsThePlanItself) {
  MotionSettings motion;
  motion.path = Path::kParts;
  motion.stagger = Stagger::kNoise;
  const MorphPlan reference = bar_plan(motion);
  const MorphPlan plan = posed_plan(reference, {reference.from, {}}, {reference.to, {}});
  const std::vector<Ball> before = balls_at(reference, 0.4f), after = balls_at(plan, 0.4f);
  for (std::size_t e = 0; e < before.size(); ++e) EXPECT_EQ(before[e].center, after[e].center) << e;
}

}  // namespace
}  // namespace polymorph
