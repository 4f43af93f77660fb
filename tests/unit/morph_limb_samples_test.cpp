#include "morph/limb_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "morph/cost.h"
#include "morph/motion.h"
#include "morph/smooth_map.h"
#include "testing/figure.h"
#include "testing/morph.h"

namespace polymorph {
namespace {

constexpr float kFigureSize = 3;

/// A figure whose left arm is missing, with raised arms.
std::vector<Ball> one_armed_figure() {
  std::vector<Ball> balls = figure(1.0f);
  std::erase_if(balls, [](const Ball& ball) { return ball.center.x < -0.25f; });
  return balls;
}

/// The right hand of figure(raised).
Vec3 hand_of(float raised) {
  return {0.2f + 0.9f * std::cos(raised), 1.5f + 0.9f * std::sin(raised), 0};
}
const Vec3 kHanging = hand_of(-0.9f), kRaised = hand_of(1.0f);

/// A plan with a landmark at the right hand, or none.
MorphPlan plan_of_figures(std::vector<Ball> from, std::vector<Ball> to, std::vector<Vec3> from_mark,
                          std::vector<Vec3> to_mark) {
  PlanSide source, target;
  source.landmarks = std::move(from_mark);
  target.landmarks = std::move(to_mark);
  source.balls = std::move(from);
  target.balls = std::move(to);
  MotionSettings motion;
  motion.easing = Easing::kLinear;
  return plan_morph(std::move(source), std::move(target), FieldKind::kGaussian, {}, motion);
}

std::vector<LimbSample> samples_at(const MorphPlan& plan, float time) {
  return limb_samples(plan, time, eased_times(plan, time), balls_at(plan, time));
}

TEST(LimbSamples, NoneWithoutLandmarksWhereALimbHasNoCounterpart) {
  const MorphPlan plan = plan_of_figures(figure(-0.9f), one_armed_figure(), {}, {});
  ASSERT_FALSE(plan.from_limbs.empty());
  EXPECT_FALSE(has_curves(plan));
  EXPECT_TRUE(samples_at(plan, 0.5f).empty());
}

TEST(LimbSamples, AllLimbsHaveThemWhereEachHasACounterpart) {
  const MorphPlan plan = plan_of_figures(figure(-0.9f), figure(1.0f), {}, {});
  ASSERT_TRUE(has_curves(plan));
  EXPECT_TRUE(plan.from_curves.lone.empty());
  EXPECT_TRUE(plan.to_curves.lone.empty());
  std::set<std::int32_t> limbs;
  for (const LimbSample& sample : samples_at(plan, 0.5f))
    limbs.insert(plan.from_limbs[plan.pairs[sample.pair].from]);
  EXPECT_EQ(limbs.size(), plan.from_curves.matched.size());
}

TEST(LimbSamples, ALoneLimbShrinksIntoItsRoot) {
  const MorphPlan plan = plan_of_figures(figure(-0.9f), one_armed_figure(), {kHanging}, {kRaised});
  ASSERT_EQ(plan.from_curves.lone.size(), 1u);
  EXPECT_TRUE(plan.to_curves.lone.empty());
  const auto reach = [&](float time) {
    float farthest = 0;
    const std::vector<LimbSample> samples = samples_at(plan, time);
    for (const LimbSample& a : samples)
      for (const LimbSample& b : samples)
        if (a.is_lone && b.is_lone) farthest = std::max(farthest, length(a.center - b.center));
    return farthest;
  };
  const float whole = reach(0);
  EXPECT_GT(whole, 0.4f);
  EXPECT_NEAR(reach(0.25f), 0.75f * whole, 0.01f);
  EXPECT_NEAR(reach(0.75f), 0.25f * whole, 0.01f);
  const std::vector<LimbSample> at_end = samples_at(plan, 1);
  EXPECT_TRUE(std::none_of(at_end.begin(), at_end.end(),
                           [](const LimbSample& sample) { return sample.is_lone; }));
}

TEST(LimbSamples, TheWayBackGrowsAsItShrinks) {
  const MorphPlan there = plan_of_figures(figure(-0.9f), one_armed_figure(), {kHanging}, {kRaised}),
                  back = plan_of_figures(one_armed_figure(), figure(-0.9f), {kRaised}, {kHanging});
  const std::vector<LimbSample> a = samples_at(there, 0.25f), b = samples_at(back, 0.75f);
  ASSERT_EQ(a.size(), b.size());
  for (const LimbSample& sample : a)
    EXPECT_TRUE(std::any_of(b.begin(), b.end(), [&](const LimbSample& other) {
      return length(sample.center - other.center) < 1e-4f && length(sample.from - other.to) < 1e-6f;
    }));
}

TEST(LimbSamples, TheMapKnowsThePlaceOnTheWholeLimb) {
  const MorphPlan plan = plan_of_figures(figure(-0.9f), one_armed_figure(), {kHanging}, {kRaised});
  const BallSet balls(balls_at(plan, 0.5f));
  const std::vector<LimbSample> samples = samples_at(plan, 0.5f);
  std::vector<Vec3> points, places;
  for (const LimbSample& sample : samples)
    if (sample.is_lone && sample.center.x < -0.4f) {  // not beside the trunk
      points.push_back(sample.center);
      places.push_back(sample.from);
      EXPECT_NEAR(sample.progress, 0.125f, 1e-6f);
    }
  ASSERT_GT(points.size(), 2u);
  const auto engine = make_cpu_engine();
  const auto pulled = pull_back(frame_map(plan, 0.5f, balls, kFigureSize), points, *engine);
  ASSERT_TRUE(pulled.ok()) << pulled.error().message;
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT(length(pulled->source[i] - places[i]), 0.1f);
    EXPECT_LT(length(pulled->target[i] - plan.from_curves.counterparts[0]), 0.1f);
  }
}

TEST(LimbSamples, AtItsOwnEndEachMapIsExact) {
  const MorphPlan plan = plan_of_figures(figure(-0.9f), one_armed_figure(), {kHanging}, {kRaised});
  const auto engine = make_cpu_engine();
  for (const float time : {0.0f, 1.0f}) {
    std::vector<Vec3> points;
    for (const Ball& ball : time == 0 ? plan.from : plan.to) points.push_back(ball.center);
    const auto pulled =
        pull_back(frame_map(plan, time, balls_at(plan, time), kFigureSize), points, *engine);
    ASSERT_TRUE(pulled.ok()) << pulled.error().message;
    const std::vector<Vec3>& there = time == 0 ? pulled->source : pulled->target;
    for (std::size_t i = 0; i < points.size(); ++i) EXPECT_LT(length(there[i] - points[i]), 1e-5f);
  }
}

}  // namespace
}  // namespace polymorph
