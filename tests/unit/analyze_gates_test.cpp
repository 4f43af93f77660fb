// The bars that a morph must clear, on pairs of objects whose answer is known.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "analyze/analyze.h"
#include "analyze/measure.h"
#include "field/extract_surface.h"
#include "field/level.h"
#include "morph/motion.h"
#include "testing/analyze.h"
#include "testing/morph.h"

namespace polymorph {
namespace {

constexpr float kCell = 0.04f;
constexpr int kFrames = 13;

struct Case {
  std::vector<Ball> from, to;
  std::vector<std::int32_t> from_labels, to_labels;
  std::optional<Similarity> truth;
  PlanSettings plan;
  MotionSettings motion = {};
};

Analysis analyze(const Case& given) {
  const auto engine = make_cpu_engine();
  const auto surface = [&](const std::vector<Ball>& balls, float iso) {
    ExtractSettings settings;
    settings.iso = iso;
    return extract_surface(*engine, balls, kCell, settings).value();
  };
  const MorphPlan plan =
      plan_morph({given.from, given.from_labels, {}}, {given.to, given.to_labels, {}},
                 FieldKind::kGaussian, given.plan, given.motion);
  MorphEnds ends;
  ends.source = surface(given.from, 1);
  ends.target = surface(given.to, 1);
  ends.truth = given.truth;
  const Alignment& fit = plan.alignment;
  ends.recovered = Similarity{fit.rotation, fit.scale,
                              fit.to_center - fit.rotation * fit.from_center * fit.scale};
  const double from_volume = volume_of(ends.source), to_volume = volume_of(ends.target);
  double same = 0;
  std::vector<double> in_from(8, 0), in_to(8, 0);
  for (const Pair& pair : plan.pairs) {
    ends.masses.push_back(pair.mass);
    if (given.from_labels.empty()) continue;
    const auto i = static_cast<std::size_t>(given.from_labels[pair.from]);
    const auto j = static_cast<std::size_t>(given.to_labels[pair.to]);
    in_from[i] += pair.mass;
    in_to[j] += pair.mass;
    same += i == j ? pair.mass : 0;
  }
  if (!given.from_labels.empty()) {
    ends.purity = same;
    ends.chance = 0;
    for (std::size_t l = 0; l < 8; ++l) *ends.chance += in_from[l] * in_to[l];
  }
  std::vector<MorphFrame> frames;
  for (int k = 0; k < kFrames; ++k) {
    const float time = static_cast<float>(k) / (kFrames - 1);
    const std::vector<Ball> balls = balls_at(plan, time);
    MorphFrame frame;
    frame.time = static_cast<double>(time);
    frame.u = static_cast<double>(progress_at(plan, time));
    const double volume = (1 - frame.u) * from_volume + frame.u * to_volume;
    const float iso =
        k == 0 || k == kFrames - 1 ? 1.0f : iso_for_volume(*engine, balls, {volume, kCell}).value();
    frame.surface = surface(balls, iso);
    for (const Ball& ball : balls) frame.centers.push_back(ball.center);
    frames.push_back(std::move(frame));
  }
  return analyze_morph(ends, frames);
}

/// What every morph of closed objects must be.
void expect_sound(const Analysis& analysis) {
  EXPECT_EQ(value(analysis, "bad_surfaces"), 0);
  EXPECT_LE(value(analysis, "backtrack"), 0.005);
  EXPECT_GE(value(analysis, "dip"), 0.98);
  EXPECT_LE(value(analysis, "pop"), 2);
  EXPECT_LE(value(analysis, "slow_in"), 0.3);
  EXPECT_LE(value(analysis, "slow_out"), 0.3);
  EXPECT_GE(value(analysis, "peak"), 0.4);
  EXPECT_LE(value(analysis, "peak"), 0.6);
  EXPECT_LE(value(analysis, "source_error"), 1e-3);
  EXPECT_LE(value(analysis, "target_error"), 1e-3);
}

class TurnedBar : public ::testing::TestWithParam<int> {};

TEST_P(TurnedBar, ArrivesByTurning) {
  Case given;
  given.from = bar();
  const Mat3 turn = exp_rotation(Vec3d{0, 0, GetParam() * std::numbers::pi / 180});
  given.to = moved(bar(), turn, 1, {});
  given.truth = Similarity{turn, 1, {}};
  const Analysis analysis = analyze(given);
  expect_sound(analysis);
  EXPECT_LE(value(analysis, "nonlinearity"), 0.02);
  EXPECT_LE(value(analysis, "rotation_error"), 0.5);
  EXPECT_LE(value(analysis, "scale_error"), 0.01);
  EXPECT_LE(value(analysis, "rigidity"), 0.02);
  EXPECT_EQ(value(analysis, "topology"), 0);
}
INSTANTIATE_TEST_SUITE_P(Degrees, TurnedBar, ::testing::Values(30, 90, 180));

TEST(Gates, StraightPathsWouldShrinkTheTurnedBar) {
  // The measure tells: without alignment the bar goes through a smaller shape than itself.
  Case given;
  given.from = bar();
  const Mat3 turn = exp_rotation(Vec3d{0, 0, std::numbers::pi / 2});
  given.to = moved(bar(), turn, 1, {});
  given.truth = Similarity{turn, 1, {}};
  given.plan.align = AlignMethod::kTranslate;
  EXPECT_GT(value(analyze(given), "nonlinearity"), 0.1);
}

TEST(Gates, DisjointSpheresArriveWhole) {
  Case given;
  for (const Ball& ball : random_balls(30, 4))
    given.from.push_back(ball_at(ball.center * 0.3f, 0.4f));
  given.to = moved(given.from, {}, 1, {4, 1, 0});
  const Analysis analysis = analyze(given);
  expect_sound(analysis);
  for (const FrameMeasures& row : analysis.frames) {
    EXPECT_GE(row.surface.volume, 0.98 * analysis.frames.front().surface.volume);
    EXPECT_EQ(row.surface.components, 1u);
  }
  EXPECT_EQ(value(analysis, "leakage"), 0);
}

TEST(Gates, ASimilarityWithNoiseIsTakenForOne) {
  Case given;
  given.from = bar();
  const Mat3 turn = exp_rotation(Vec3d{0.5, -0.8, 0.7});
  given.to = moved(bar(), turn, 1.4, {2, 1, 0});
  for (std::size_t i = 0; i < given.to.size(); ++i) {
    const auto noise = [&](std::uint64_t k) { return 0.01f * (random_float(7, k, i) - 0.5f); };
    given.to[i].center = given.to[i].center + Vec3{noise(0), noise(1), noise(2)};
  }
  given.truth = Similarity{turn, 1.4, {2, 1, 0}};
  const Analysis analysis = analyze(given);
  EXPECT_LE(value(analysis, "rotation_error"), 0.5);
  EXPECT_LE(value(analysis, "scale_error"), 0.01);
  EXPECT_LE(value(analysis, "translation_error"), 0.01);
  EXPECT_LE(value(analysis, "nonlinearity"), 0.02);
}

TEST(Gates, AnObjectAndItselfStandStill) {
  Case given;
  given.from = given.to = bar();
  given.truth = Similarity{};
  const Analysis analysis = analyze(given);
  EXPECT_LE(value(analysis, "nonlinearity"), 1e-3);
  EXPECT_EQ(value(analysis, "leakage"), 0);
  EXPECT_EQ(value(analysis, "topology"), 0);
  EXPECT_LE(value(analysis, "backtrack"), 0.005);
}

TEST(Gates, LabelledLimbsBecomeTheirLimbs) {
  const Creature a = creature(0.9f, 0.9f, 9), b = creature(0.7f, 0.3f, 6);
  Case given{a.balls, b.balls, a.labels, b.labels, std::nullopt, {}};
  given.plan.label_mode = LabelMode::kHard;
  const Analysis analysis = analyze(given);
  expect_sound(analysis);
  EXPECT_GE(value(analysis, "attributes"), 0.95);
  EXPECT_LE(value(analysis, "leakage"), 1e-3) << "a limb that swings leaves the hull of both ends";
  EXPECT_EQ(value(analysis, "topology"), 0);
  given.plan.label_mode = LabelMode::kOff;
  EXPECT_GE(value(analyze(given), "attributes"), 0.5);  // by shape alone; chance is 0
}

TEST(Gates, LabelledPartsHoldTheirNeighboursBetterThanOneTurnDoes) {
  const Creature a = creature(0.9f, 0.9f, 9), b = creature(0.7f, 0.3f, 6);
  Case given{a.balls, b.balls, a.labels, b.labels, std::nullopt, {}};
  given.plan.label_mode = LabelMode::kHard;
  given.motion.path = Path::kRigid;
  const double rigid = value(analyze(given), "rigidity");
  given.motion.path = Path::kParts;
  const Analysis parts = analyze(given);
  expect_sound(parts);
  RecordProperty("rigid", std::to_string(rigid));
  RecordProperty("parts", std::to_string(value(parts, "rigidity")));
  EXPECT_LT(value(parts, "rigidity"), 0.25 * rigid);
  EXPECT_EQ(value(parts, "topology"), 0);
  EXPECT_LE(value(parts, "leakage"), 1e-3) << "a limb that swings leaves the hull of both ends";
}

TEST(Gates, LimbsThatOnlySwingStayRigidAsParts) {
  // Arms and legs turn about where they grow out of the trunk, each its own way.
  const Creature a = creature(0.9f, 0.9f, 9);
  Creature b = a;
  for (std::size_t i = 0; i < b.balls.size(); ++i) {
    const std::int32_t limb = a.labels[i];
    if (limb == 0) continue;
    const double side = limb % 2 ? -1 : 1, end = limb <= 2 ? 1 : -1;
    const Vec3d joint{side * 0.2, end * 0.45, 0.05 * end};
    const Mat3 turn = exp_rotation(Vec3d{0, 0, side * end * 80 * std::numbers::pi / 180});
    b.balls[i].center = to_float(joint + turn * (Vec3d(a.balls[i].center) - joint));
  }
  Case given{a.balls, b.balls, a.labels, b.labels, std::nullopt, {}};
  given.plan.label_mode = LabelMode::kHard;
  given.motion.path = Path::kRigid;
  const double rigid = value(analyze(given), "rigidity");
  given.motion.path = Path::kParts;
  const double parts = value(analyze(given), "rigidity");
  RecordProperty("rigid", std::to_string(rigid));
  RecordProperty("parts", std::to_string(parts));
  EXPECT_GT(rigid, 0.1);
  EXPECT_LT(parts, 0.4 * rigid);
}

TEST(Gates, BackwardsIsTheSameMorphFrameByFrame) {
  const Creature a = creature(0.9f, 0.9f, 9), b = creature(0.7f, 0.3f, 6);
  const Analysis there = analyze({a.balls, b.balls, {}, {}, std::nullopt, {}});
  const Analysis back = analyze({b.balls, a.balls, {}, {}, std::nullopt, {}});
  for (std::size_t k = 0; k < there.frames.size(); ++k) {
    const MeshReport& one = there.frames[k].surface;
    const MeshReport& two = back.frames[there.frames.size() - 1 - k].surface;
    EXPECT_NEAR(one.volume / two.volume, 1, 2e-3);  // levels are found to 0.2 %
    EXPECT_NEAR(one.area / two.area, 1, 2e-3);
    EXPECT_EQ(one.components, two.components);
    EXPECT_EQ(one.genus, two.genus);
  }
}

TEST(Gates, BackwardsTheSurfacesAreTheSame) {
  const Creature a = creature(0.9f, 0.9f, 9), b = creature(0.7f, 0.3f, 6);
  const auto engine = make_cpu_engine();
  const MorphPlan there =
      plan_morph({a.balls, a.labels, {}}, {b.balls, b.labels, {}}, FieldKind::kGaussian, {});
  const MorphPlan back =
      plan_morph({b.balls, b.labels, {}}, {a.balls, a.labels, {}}, FieldKind::kGaussian, {});
  const auto surface = [&](const MorphPlan& plan, float time) {
    const Mesh mesh = extract_surface(*engine, balls_at(plan, time), kCell, {}).value();
    return std::pair(MeasuredSurface(mesh.positions, mesh.triangles),
                     static_cast<double>(bounding_box(mesh.positions).diagonal()));
  };
  for (int k = 0; k <= 8; ++k) {
    const float time = static_cast<float>(k) / 8;
    const auto one = surface(there, time), two = surface(back, 1 - time);
    EXPECT_LT(one.first.distance_to(two.first).largest, 1e-3 * one.second) << time;
  }
}

}  // namespace
}  // namespace polymorph
