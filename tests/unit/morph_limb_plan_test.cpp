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
  const auto there = warp_balls(a, plan.from, plan.to, plan.match.limbs, plan.match.angle);
  const auto same = warp_balls(a, plan.from, plan.from, match_limbs(plan.from, plan.from).limbs, 0);
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
  PlanSettings settings;
  settings.label_mode = labels;
  LimbPlan plan = find_limbs_of_sides(a, b, settings);
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
  const auto plan = plan_limbs(a, b, LabelMode::kSoft);
  ASSERT_TRUE(plan);
  const auto names = list_limb_names(*plan);
  for (const auto& [one, other] : {std::pair("left arm", "right arm"), {"right arm", "left arm"}})
    EXPECT_NE(
        std::find(names.begin(), names.end(), std::pair<std::string, std::string>(one, other)),
        names.end());
  EXPECT_TRUE(plan_limbs(a, b, LabelMode::kOff));
}

/// Labels the balls of a figure(): 1 and 2 on its left and right, 3 on its head, 4 on the rest.
std::vector<std::int32_t> labels_of_figure(const std::vector<Ball>& balls) {
  std::vector<std::int32_t> labels;
  for (const Ball& ball : balls) {
    const Vec3 p = ball.center;
    const bool is_arm = p.y > 1 && std::abs(p.x) > 0.21f;
    labels.push_back(is_arm ? (p.x < 0 ? 1 : 2) : p.y > 1.8f ? 3 : 4);
  }
  return labels;
}

std::vector<Ball> without_legs(std::vector<Ball> balls) {
  std::erase_if(balls, [](const Ball& ball) {
    return ball.center.y < 0.9f && std::abs(ball.center.x) > 0.1f;
  });
  return balls;
}

bool has_pair(const MorphPlan& plan, const char* from, const char* to) {
  return std::find(plan.limb_names.begin(), plan.limb_names.end(),
                   std::pair<std::string, std::string>(from, to)) != plan.limb_names.end();
}

/// Plans as if the user had said that labels of equal numbers correspond.
MorphPlan plan_sides(const PlanSide& a, const PlanSide& b) {
  PlanSettings settings = with(PlanStructure::kAuto);
  settings.labels = {{"arm", "arm"}};
  return plan_morph(a, b, FieldKind::kGaussian, settings);
}

TEST(LimbPlan, LabelsDecideWhichLimbsMatch) {
  // Two limbs of the one and five of the other are too few to be certain.
  std::vector<Ball> armless = figure();
  std::erase_if(armless, [](const Ball& ball) { return std::abs(ball.center.x) > 0.25f; });
  PlanSide a{without_legs(armless), {}, {}}, b{figure(0.8f), {}, {}};
  ASSERT_TRUE(plan_sides(a, b).limb_names.empty());
  a.labels = labels_of_figure(a.balls), b.labels = labels_of_figure(b.balls);
  const MorphPlan plan = plan_sides(a, b);
  ASSERT_TRUE(has_pair(plan, "head", "head"));
  EXPECT_TRUE(has_pair(plan, "", "left arm"));
  EXPECT_GT(kept(plan), 0.9);
  EXPECT_EQ(plan.to_curves.lone.size(), 4u);  // as beside landmarks
  // Equal names in both files alone do not make an uncertain match.
  PlanSettings off = with(PlanStructure::kAuto);
  EXPECT_TRUE(plan_morph(a, b, FieldKind::kGaussian, off).limb_names.empty());
  off.label_mode = LabelMode::kOff;
  EXPECT_TRUE(plan_morph(a, b, FieldKind::kGaussian, off).limb_names.empty());
}

TEST(LimbPlan, AnArmThatIsNoLimbThereIsNotLone) {
  PlanSide a{figure(-0.3f), {}, {}}, b{figure(0.8f), {}, {}};
  a.labels = labels_of_figure(a.balls), b.labels = labels_of_figure(b.balls);
  const auto drop_hand = [](PlanSide& side) {
    for (std::size_t i = side.balls.size(); i-- > 0;)
      if (side.labels[i] == 2 && side.balls[i].center.x > 0.4f) {
        side.balls.erase(side.balls.begin() + static_cast<std::ptrdiff_t>(i));
        side.labels.erase(side.labels.begin() + static_cast<std::ptrdiff_t>(i));
      }
  };
  drop_hand(b);
  ASSERT_TRUE(std::find(b.labels.begin(), b.labels.end(), 2) != b.labels.end());
  const MorphPlan labelled = plan_sides(a, b);
  EXPECT_TRUE(has_pair(labelled, "right arm", ""));
  EXPECT_TRUE(labelled.from_curves.lone.empty());
  std::replace(a.labels.begin(), a.labels.end(), 2, kNoLabel);
  std::replace(b.labels.begin(), b.labels.end(), 2, 4);
  EXPECT_EQ(plan_sides(a, b).from_curves.lone.size(), 1u);
}

TEST(LimbPlan, LabelsDecideAgainstTheCost) {
  PlanSide a{figure(-0.3f), {}, {}}, b{figure(0.8f), {}, {}};
  a.labels = labels_of_figure(a.balls), b.labels = labels_of_figure(b.balls);
  for (std::int32_t& label : b.labels) label = label == 1 ? 3 : label == 3 ? 1 : label;
  const MorphPlan plan = plan_sides(a, b);
  EXPECT_TRUE(has_pair(plan, "left arm", "head"));
  EXPECT_TRUE(has_pair(plan, "head", "left arm"));
  EXPECT_TRUE(has_pair(plan, "right arm", "right arm"));
  // Landmarks beat them.
  a.landmarks = b.landmarks = {{0, 2.2f, 0}};
  EXPECT_TRUE(has_pair(plan_sides(a, b), "head", "head"));
}

TEST(LimbPlan, LabelsOnOneLimbAreOne) {
  // Most of the one's arm is its upper arm and most of the other's is its hand.
  PlanSide a{figure(-0.3f), {}, {}}, b{figure(0.8f), {}, {}};
  const auto label = [](PlanSide& side, float elbow) {
    side.labels = labels_of_figure(side.balls);
    for (std::size_t i = 0; i < side.balls.size(); ++i)
      if (side.labels[i] == 2 && side.balls[i].center.x > elbow) side.labels[i] = 5;
  };
  label(a, 0.65f), label(b, 0.35f);
  const MorphPlan plan = plan_sides(a, b);
  EXPECT_TRUE(has_pair(plan, "right arm", "right arm"));
  EXPECT_TRUE(has_pair(plan, "left arm", "left arm"));
}

TEST(LimbPlan, ALabelOfTheWholeBodyDecidesNothing) {
  PlanSide a{random_balls(60, 1), {}, {}}, b{figure(), {}, {}};
  const MorphPlan plain = plan_sides(a, b);
  a.labels.assign(a.balls.size(), 0), b.labels.assign(b.balls.size(), 0);
  const MorphPlan plan = plan_sides(a, b);
  EXPECT_TRUE(plan.limb_names.empty());
  expect_same(plan, plain);
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
