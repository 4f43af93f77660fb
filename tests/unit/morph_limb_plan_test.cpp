#include "morph/limb_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>

#include "morph/motion.h"
#include "morph/smooth_map.h"
#include "testing/figure.h"
#include "testing/morph.h"
#include "testing/paths.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

PlanSettings with(PlanStructure structure) {
  PlanSettings settings;
  settings.structure = structure;
  return settings;
}

MorphPlan plan_figures(const std::vector<Ball>& a, const std::vector<Ball>& b,
                       const PlanSettings& settings, const std::filesystem::path& cache = {}) {
  return plan_morph({a, {}, {}}, {b, {}, {}}, FieldKind::kGaussian, settings, {}, cache);
}

/// How many of the matched limbs' balls, by mass, go to the limb's counterpart.
double kept(const MorphPlan& plan) {
  double sum = 0, all = 0;
  for (const Pair& pair : plan.pairs) {
    if (plan.from_limbs[pair.from] == kNoLabel) continue;
    all += pair.mass;
    if (plan.from_limbs[pair.from] == plan.to_limbs[pair.to]) sum += pair.mass;
  }
  return sum / all;
}

TEST(LimbPlan, LimbsBecomeLimbsInAnotherPose) {
  const auto hanging = figure(-0.9f), raised = figure(1.0f);
  const MorphPlan plan = plan_figures(hanging, raised, with(PlanStructure::kAuto));
  ASSERT_EQ(plan.limb_names.size(), 5u);
  for (const auto& [from, to] : plan.limb_names) EXPECT_EQ(from, to);
  EXPECT_GT(kept(plan), 0.9);
  // Without them hands go elsewhere.
  MorphPlan off = plan_figures(hanging, raised, with(PlanStructure::kOff));
  EXPECT_TRUE(off.from_limbs.empty());
  off.from_limbs = plan.from_limbs, off.to_limbs = plan.to_limbs;
  EXPECT_LT(kept(off), kept(plan));
}

TEST(LimbPlan, NearCopiesStayAsTheyAre) {
  const auto a = figure(), b = moved(figure(), exp_rotation({0, 0.6, 0}), 1.2, {1, 0, 0});
  const MorphPlan plan = plan_figures(a, b, with(PlanStructure::kAuto));
  EXPECT_TRUE(plan.from_limbs.empty());
  expect_same(plan, plan_figures(a, b, with(PlanStructure::kOff)));
}

TEST(LimbPlan, LandmarksDecideWhichLimbsMatch) {
  const std::vector<Ball> hanging = figure(-0.9f), raised = figure(1.0f);
  // The right hand becomes the right foot.
  const Vec3 hand = {0.2f + 0.9f * std::cos(-0.9f), 1.5f + 0.9f * std::sin(-0.9f), 0},
             foot = {0.2f, 0.08f, 0.18f};
  const MorphPlan plan = plan_morph({hanging, {}, {hand}}, {raised, {}, {foot}},
                                    FieldKind::kGaussian, with(PlanStructure::kAuto));
  const auto is_arm_to_leg = [](const auto& names) {
    return names.first.find("arm") != std::string::npos &&
           names.second.find("leg") != std::string::npos;
  };
  EXPECT_EQ(std::count_if(plan.limb_names.begin(), plan.limb_names.end(), is_arm_to_leg), 1);
  EXPECT_GT(kept(plan), 0.9);
  ASSERT_FALSE(plan.from_curves.matched.empty());
}

TEST(LimbPlan, PartsAreTheLimbs) {
  const auto a = figure(-0.9f), b = figure(0.8f);
  MotionSettings motion;
  motion.path = Path::kParts;
  const MorphPlan plan = plan_morph({a, {}, {}}, {b, {}, {}}, FieldKind::kGaussian,
                                    with(PlanStructure::kAuto), motion);
  ASSERT_EQ(plan.parts.size(), 6u);  // and the rest
  // A hand swings about the shoulder instead of taking the short way through the body.
  const std::vector<Ball> half = balls_at(plan, 0.5f);
  float farthest = 0;
  for (const Ball& ball : half) farthest = std::max(farthest, std::abs(ball.center.x));
  EXPECT_GT(farthest, 0.95f);
}

TEST(LimbPlan, ThePathByDefaultIsThatOfPartsWhereLimbsAreCertain) {
  const auto path = [](const std::vector<Ball>& a, const std::vector<Ball>& b) {
    return plan_figures(a, b, PlanSettings{}).motion.path;
  };
  EXPECT_EQ(path(figure(-0.9f), figure(0.8f)), Path::kParts);
  EXPECT_EQ(path(random_balls(50, 2), random_balls(70, 3)), Path::kRigid);
}

TEST(LimbPlan, ThereAndBackAreTheSame) {
  const auto a = figure(-0.9f), b = figure(0.8f);
  const MorphPlan there = plan_figures(a, b, with(PlanStructure::kAuto)),
                  back = plan_figures(b, a, with(PlanStructure::kAuto));
  ASSERT_EQ(there.pairs.size(), back.pairs.size());
  EXPECT_EQ(there.from_limbs, back.to_limbs);
  for (std::size_t e = 0; e < there.pairs.size(); ++e) {
    EXPECT_EQ(there.pairs[e].from, back.pairs[e].to);
    EXPECT_EQ(there.pairs[e].to, back.pairs[e].from);
  }
}

TEST(LimbPlan, WithoutCertainLimbsThePlanStaysAsItIs) {
  for (const auto& [a, b] : {std::pair(random_balls(60, 1), figure()),
                             {bar(), figure()},
                             {random_balls(50, 2), random_balls(70, 3)}}) {
    const MorphPlan plan = plan_figures(a, b, with(PlanStructure::kAuto));
    EXPECT_TRUE(plan.from_limbs.empty());
    expect_same(plan, plan_figures(a, b, with(PlanStructure::kOff)));
  }
}

TEST(LimbPlan, IsTheSameFromTheCache) {
  const TemporaryFolder folder;
  const auto a = figure(-0.9f), b = figure(0.8f);
  const auto plan = [&] { return plan_figures(a, b, with(PlanStructure::kAuto), folder.path()); };
  const MorphPlan made = plan(), read = plan();
  EXPECT_FALSE(made.from_limbs.empty());
  expect_same(made, read);
}

TEST(LimbPlan, PlacesAreCarriedAlongTheLimbs) {
  const auto a = figure(), b = figure(0.8f);
  LimbPlan plan = {find_limbs(a), find_limbs(b), {}};
  plan.match = match_limbs(plan.from, plan.to);
  const auto there = warped_places(a, plan.from, plan.to, plan.match.limbs, plan.match.angle);
  const auto same =
      warped_places(a, plan.from, plan.from, match_limbs(plan.from, plan.from).limbs, 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_LT(length(there[i] - Vec3d(b[i].center)), 0.2) << i;
    EXPECT_LT(length(same[i] - Vec3d(a[i].center)), 1e-6) << i;
  }
}

TEST(LimbPlan, MassesOfMatchedLimbsAreEven) {
  const std::vector<double> from{0.5, 0.1, 0.4}, to{0.1, 0.1, 0.8};
  const std::vector<std::int32_t> from_limbs{0, 0, kNoLabel}, to_limbs{0, 0, kNoLabel};
  const auto [a, b] = balance_masses(from, from_limbs, to, to_limbs);
  EXPECT_NEAR(a[0] + a[1], b[0] + b[1], 1e-12);
  EXPECT_NEAR(a[0] / a[1], 5, 1e-9);  // within a limb as they were
  EXPECT_NEAR(a[0] + a[1] + a[2], 1, 1e-12);
  EXPECT_GT(a[0] + a[1], 0.2);
  EXPECT_LT(a[0] + a[1], 0.6);
}

std::optional<LimbPlan> plan_limbs(const PlanSide& a, const PlanSide& b, LabelMode labels) {
  LimbPlan plan = find_limbs_of_sides(a, b, labels);
  plan.match = match_at(plan, 0);
  return is_certain(plan.match) ? std::optional(plan) : std::nullopt;
}

TEST(LimbPlan, LabelsAndLandmarksGoFirst) {
  PlanSide a{figure(), {}, {}}, b{figure(), {}, {}};
  ASSERT_TRUE(plan_limbs(a, b, LabelMode::kSoft));
  // The user says that the head becomes the left hand, and the other way round.
  const Vec3 head{0, 2.2f, 0}, hand{-1.05f, 1.5f, 0};
  a.landmarks = {head, hand};
  b.landmarks = {hand, head};
  if (const auto plan = plan_limbs(a, b, LabelMode::kSoft)) {
    for (const auto& [from, to] : list_limb_names(*plan))
      EXPECT_FALSE(from == "head" && to == "head");
  }
  a.landmarks.clear(), b.landmarks.clear();
  const auto label = [](PlanSide& side, bool swapped) {
    for (const Ball& ball : side.balls)
      side.labels.push_back(ball.center.x < -0.45f  ? (swapped ? 1 : 0)
                            : ball.center.x > 0.45f ? (swapped ? 0 : 1)
                                                    : 2);
  };
  label(a, false), label(b, true);
  if (const auto plan = plan_limbs(a, b, LabelMode::kSoft)) {
    for (const auto& [from, to] : list_limb_names(*plan))
      EXPECT_FALSE(from == "left arm" && to == "left arm");
  }
  EXPECT_TRUE(plan_limbs(a, b, LabelMode::kOff));
}

TEST(LimbPlan, TheMapReachesTheHands) {
  const auto a = figure(-0.9f), b = figure(1.0f);
  const Vec3 hand{0.2f + 0.9f * std::cos(-0.9f), 1.5f + 0.9f * std::sin(-0.9f), 0},
      there{0.2f + 0.9f * std::cos(1.0f), 1.5f + 0.9f * std::sin(1.0f), 0};
  const auto engine = make_cpu_engine();
  const auto miss = [&](PlanStructure structure) {
    const MorphPlan plan = plan_figures(a, b, with(structure));
    const auto back = pull_back(frame_map(plan, 0, balls_at(plan, 0), 2.8f), {hand}, *engine);
    EXPECT_TRUE(back.ok());
    return length(back->target[0] - there);
  };
  EXPECT_LT(miss(PlanStructure::kAuto), 0.25f);
  EXPECT_LT(miss(PlanStructure::kAuto), 0.5f * miss(PlanStructure::kOff));
}

}  // namespace
}  // namespace polymorph
