#include "morph/plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "morph/align.h"
#include "morph/cost.h"
#include "morph/labels.h"
#include "morph/mass.h"
#include "morph/motion.h"
#include "testing/morph.h"

namespace polymorph {
namespace {

PlanSettings by(PlanMethod method, std::uint64_t seed = 0) {
  PlanSettings settings;
  settings.method = method;
  settings.seed = seed;
  return settings;
}

MorphPlan plan_of(const std::vector<Ball>& a, const std::vector<Ball>& b, PlanSettings settings,
                  FieldKind kind = FieldKind::kGaussian) {
  return plan_morph({a, {}, {}}, {b, {}, {}}, kind, settings);
}

double field(const std::vector<Ball>& balls, Vec3 p, FieldKind kind) {
  double sum = 0;
  for (const Ball& b : balls) {
    const Vec3 d = p - b.center;
    sum += kind == FieldKind::kGaussian
               ? std::exp(static_cast<double>(b.w - b.a * quadratic(b.shape, d)))
               : static_cast<double>(b.w) / static_cast<double>(dot(d, d));
  }
  return sum;
}

class PlanTest : public ::testing::TestWithParam<PlanMethod> {};

TEST_P(PlanTest, SharesOfEveryBallSumToOneOnBothSides) {
  for (const auto& [n, m] : {std::pair{40, 40}, {7, 90}, {90, 7}, {1, 5}, {5, 1}, {1, 1}}) {
    const MorphPlan plan = plan_of(random_balls(n, 1), random_balls(m, 2), by(GetParam(), 3));
    std::vector<double> from(static_cast<std::size_t>(n)), to(static_cast<std::size_t>(m));
    double mass = 0;
    for (const Pair& pair : plan.pairs) {
      EXPECT_GT(pair.from_share, 0);
      EXPECT_GT(pair.to_share, 0);
      from.at(pair.from) += static_cast<double>(pair.from_share);
      to.at(pair.to) += static_cast<double>(pair.to_share);
      mass += pair.mass;
    }
    for (const double share : from) EXPECT_NEAR(share, 1, 1e-5);
    for (const double share : to) EXPECT_NEAR(share, 1, 1e-5);
    EXPECT_NEAR(mass, 1, 1e-5);
    EXPECT_LE(plan.pairs.size(), static_cast<std::size_t>(n + m));
  }
}

TEST_P(PlanTest, TheEndsAreTheObjectsOwnFields) {
  for (const FieldKind kind : {FieldKind::kGaussian, FieldKind::kInverseSquare}) {
    const auto a = random_balls(30, 1), b = random_balls(50, 2, {2, 0, 0});
    const MorphPlan plan = plan_of(a, b, by(GetParam()), kind);
    for (int i = 0; i < 40; ++i) {
      const Vec3 p{random_float(9, 0, static_cast<std::uint64_t>(i)) * 3,
                   random_float(9, 1, static_cast<std::uint64_t>(i)), 0.3f};
      EXPECT_NEAR(field(balls_at(plan, 0), p, kind) / field(a, p, kind), 1, 2e-5);
      EXPECT_NEAR(field(balls_at(plan, 1), p, kind) / field(b, p, kind), 1, 2e-5);
    }
  }
}

TEST_P(PlanTest, IsTheSameEveryTime) {
  const auto plan = [] {
    return plan_of(random_balls(60, 1), random_balls(45, 2), by(GetParam(), 11));
  };
  const MorphPlan one = plan(), two = plan();
  ASSERT_EQ(one.pairs.size(), two.pairs.size());
  for (std::size_t i = 0; i < one.pairs.size(); ++i) {
    EXPECT_EQ(one.pairs[i].from, two.pairs[i].from);
    EXPECT_EQ(one.pairs[i].to, two.pairs[i].to);
    EXPECT_EQ(one.pairs[i].from_share, two.pairs[i].from_share);
  }
}

TEST_P(PlanTest, BackwardsIsTheMirrorImage) {
  PlanSettings settings = by(GetParam(), 4);
  settings.weights.align_gain = 0.02f;  // so that turns take part
  const auto a = random_balls(60, 1), b = random_balls(45, 2);
  const MorphPlan there = plan_of(a, b, settings), back = plan_of(b, a, settings);
  ASSERT_EQ(there.pairs.size(), back.pairs.size());
  for (std::size_t i = 0; i < there.pairs.size(); ++i) {
    EXPECT_EQ(there.pairs[i].from, back.pairs[i].to);
    EXPECT_EQ(there.pairs[i].to, back.pairs[i].from);
    EXPECT_EQ(there.pairs[i].from_share, back.pairs[i].to_share);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, PlanTest,
                         ::testing::Values(PlanMethod::kIndex, PlanMethod::kNearest,
                                           PlanMethod::kTransport),
                         [](const auto& method) {
                           return method.param == PlanMethod::kIndex     ? "Index"
                                  : method.param == PlanMethod::kNearest ? "Nearest"
                                                                         : "Transport";
                         });

TEST(IndexPlan, PairsInOrderAndDrawsTheSurplusBySeed) {
  const auto a = random_balls(3, 1), b = random_balls(8, 2);
  const MorphPlan plan = plan_of(a, b, by(PlanMethod::kIndex, 1));
  const MorphPlan other = plan_of(a, b, by(PlanMethod::kIndex, 2));
  ASSERT_EQ(plan.pairs.size(), 8u);
  std::vector<std::uint32_t> sources(8), others(8);
  for (const Pair& pair : plan.pairs) sources[pair.to] = pair.from;
  for (const Pair& pair : other.pairs) others[pair.to] = pair.from;
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(sources[i], i);
  EXPECT_NE(sources, others);
}

/// How far a direction upwards is turned away from there, in radians.
double tilt(const MorphPlan& plan) {
  const Vec3d up = plan.alignment.rotation * Vec3d{0, 1, 0};
  return std::acos(std::clamp(up.y, -1.0, 1.0));
}

TEST(Alignment, OnlyACopyIsTippedOver) {
  const Mat3 tip = exp_rotation({1.2, 0, 0.4});
  const MorphPlan copy = plan_of(bar(), moved(bar(), tip, 1, {}), {});
  EXPECT_NEAR(rotation_angle(copy.alignment.rotation), rotation_angle(tip), 1e-3);
  // A bar that lies and a post that stands, with a knob on another side and of another size: laying
  // the one on the other would be cheap.
  std::vector<Ball> post;
  for (int i = 0; i <= 16; ++i)
    post.push_back(ball_at({0, -1 + 0.125f * static_cast<float>(i), 0}, 0.3f));
  for (int i = 1; i <= 5; ++i)
    post.push_back(ball_at({-0.15f * static_cast<float>(i), -0.3f, 0}, 0.3f));
  const MorphPlan other = plan_of(bar(), post, {});
  EXPECT_LT(tilt(other), 1e-6);
  PlanSettings free;
  free.weights.align_tip_residual = 100;
  EXPECT_GT(tilt(plan_of(bar(), post, free)), 1.0);
  PlanSettings never;
  never.weights.align_tip_residual = 0;
  EXPECT_LT(tilt(plan_of(bar(), moved(bar(), tip, 1, {}), never)), 1e-6);
}

TEST(Alignment, TurnsAboutTheVerticalAreFound) {
  for (const double angle : {0.5, 1.6, 3.0, -2.2}) {
    const Mat3 turn = exp_rotation({0, angle, 0});
    const MorphPlan plan = plan_of(bar(), moved(bar(), turn, 1, {}), {});
    EXPECT_NEAR(rotation_angle(transposed(turn) * plan.alignment.rotation), 0, 1e-3) << angle;
  }
}

TEST(TransportPlan, ACopyIsPairedWithItself) {
  const auto a = random_balls(64, 1);
  const auto b = moved(a, {}, 1, {3, 1, 0});
  const MorphPlan plan = plan_of(a, b, {});
  double own = 0;
  for (const Pair& pair : plan.pairs) own += pair.from == pair.to ? pair.mass : 0;
  EXPECT_GT(own, 0.99);
}

TEST(TransportPlan, MovesMuchLessThanTheIndexPlanAndNoMoreThanTheNearest) {
  const auto a = random_balls(200, 1), b = random_balls(150, 2);
  PlanSettings plain = by(PlanMethod::kTransport);
  plain.align = AlignMethod::kNone;
  plain.weights.size = plain.weights.feature = 0;
  const auto cost = [&](PlanMethod method) {
    plain.method = method;
    double sum = 0;
    const MorphPlan plan = plan_of(a, b, plain);
    for (const Pair& pair : plan.pairs) {
      const Vec3 d = plan.from[pair.from].center - plan.to[pair.to].center;
      sum += pair.mass * static_cast<double>(dot(d, d));
    }
    return sum;
  };
  EXPECT_LT(cost(PlanMethod::kTransport), 0.2 * cost(PlanMethod::kIndex));
}

TEST(TransportPlan, FindsHowTheBarWasTurned) {
  for (const double degrees : {30.0, 90.0, 180.0})
    for (const Vec3d axis : {Vec3d{0, 0, 1}, Vec3d{1, 0, 0}, normalized(Vec3d{1, 2, -1})}) {
      const Mat3 turn = exp_rotation(axis * (degrees * std::numbers::pi / 180));
      const MorphPlan plan = plan_of(bar(), moved(bar(), turn, 1, {4, 0, 1}), {});
      EXPECT_LT(angle_between(plan.alignment.rotation, turn), 0.5)
          << degrees << " about " << axis.x << ' ' << axis.y << ' ' << axis.z;
    }
}

TEST(TransportPlan, FindsASimilarityUnderNoise) {
  const Mat3 turn = exp_rotation(Vec3d{0.4, -0.9, 1.1});
  std::vector<Ball> b = moved(bar(), turn, 1.7, {1, 2, 3});
  for (std::size_t i = 0; i < b.size(); ++i) {
    const auto noise = [&](std::uint64_t k) { return 0.01f * (random_float(5, k, i) - 0.5f); };
    b[i].center = b[i].center + Vec3{noise(0), noise(1), noise(2)};
  }
  const MorphPlan plan = plan_of(bar(), b, {});
  EXPECT_LT(angle_between(plan.alignment.rotation, turn), 0.5);
  EXPECT_NEAR(plan.alignment.scale, 1.7, 0.017);
}

/// Three balls near one another are as large as three that lie apart.
TEST(TransportPlan, TheCentresOfFewBallsDoNotScale) {
  std::vector<Ball> near, apart;
  for (const Vec3 p : {Vec3{1, 0, 0}, Vec3{0, 0.7f, 0}, Vec3{0, 0, 0.4f}}) {
    near.push_back(ball_at(p * 0.05f, 1));
    apart.push_back(ball_at(p * 0.5f, 0.75f));
  }
  const double bodies = radius_of_gyration(apart, FieldKind::kGaussian, {0.15, 0.1, 0.05}) /
                        radius_of_gyration(near, FieldKind::kGaussian, {0.015, 0.01, 0.005});
  EXPECT_NEAR(bodies, 1, 0.2);
  EXPECT_NEAR(plan_of(near, apart, {}).alignment.scale, 1, 0.2);
  EXPECT_NEAR(plan_of(apart, near, {}).alignment.scale, 1, 0.2);
}

TEST(TransportPlan, AnObjectAndItselfStayUnturned) {
  const MorphPlan plan = plan_of(bar(), bar(), {});
  EXPECT_EQ(rotation_angle(plan.alignment.rotation), 0);
  EXPECT_EQ(plan.alignment.scale, 1);
  for (const float time : {0.0f, 0.3f, 0.5f, 1.0f}) {
    const std::vector<Ball> balls = balls_at(plan, time);
    for (std::size_t e = 0; e < balls.size(); ++e)
      EXPECT_LT(length(balls[e].center - plan.from[plan.pairs[e].from].center), 1e-5f);
  }
}

double purity(const MorphPlan& plan, const Creature& a, const Creature& b) {
  double same = 0;
  for (const Pair& pair : plan.pairs)
    if (a.labels[pair.from] == b.labels[pair.to]) same += pair.mass;
  return same;
}

TEST(TransportPlan, LabelledLimbsBecomeLimbsAndUnlabelledOnesMostly) {
  const Creature a = creature(0.9f, 0.9f, 9), b = creature(0.7f, 0.3f, 6);
  std::vector<double> mass_a = ball_masses(a.balls, FieldKind::kGaussian),
                      mass_b = ball_masses(b.balls, FieldKind::kGaussian);
  double chance = 0;
  for (int label = 0; label < 5; ++label) {
    double in_a = 0, in_b = 0;
    for (std::size_t i = 0; i < a.balls.size(); ++i) in_a += a.labels[i] == label ? mass_a[i] : 0;
    for (std::size_t j = 0; j < b.balls.size(); ++j) in_b += b.labels[j] == label ? mass_b[j] : 0;
    chance += in_a * in_b;
  }
  const auto attributes = [&](const MorphPlan& plan) {
    return (purity(plan, a, b) - chance) / (1 - chance);
  };
  PlanSettings hard;
  hard.label_mode = LabelMode::kHard;
  const MorphPlan labelled =
      plan_morph({a.balls, a.labels, {}}, {b.balls, b.labels, {}}, FieldKind::kGaussian, hard);
  EXPECT_NEAR(attributes(labelled), 1, 1e-6);
  const MorphPlan soft =
      plan_morph({a.balls, a.labels, {}}, {b.balls, b.labels, {}}, FieldKind::kGaussian, {});
  EXPECT_GT(attributes(soft), 0.75);
  EXPECT_GT(attributes(plan_of(a.balls, b.balls, {})), 0.6);
  EXPECT_LT(attributes(plan_of(a.balls, b.balls, by(PlanMethod::kIndex))), 0.6);
}

TEST(TransportPlan, AHardLabelIsNeverLeftEvenWhereOtherBallsHaveNone) {
  Creature a = creature(0.9f, 0.9f, 9), b = creature(0.7f, 0.3f, 6);
  for (std::int32_t& label : b.labels)
    if (label >= 3) label = -1;  // two limbs of b belong to nothing
  for (std::int32_t& label : a.labels)
    if (label >= 3) label = 0;
  PlanSettings hard;
  hard.label_mode = LabelMode::kHard;
  const MorphPlan plan =
      plan_morph({a.balls, a.labels, {}}, {b.balls, b.labels, {}}, FieldKind::kGaussian, hard);
  for (const Pair& pair : plan.pairs)
    if (b.labels[pair.to] >= 0) {
      EXPECT_EQ(a.labels[pair.from], b.labels[pair.to]);
    }
}

TEST(TransportPlan, LandmarksOverruleNearness) {
  // Two equal balls left and right; the landmarks say that left becomes right.
  const std::vector<Ball> two{ball_at({-1, 0, 0}, 0.3f), ball_at({1, 0, 0}, 0.3f)};
  PlanSettings settings;
  settings.align = AlignMethod::kNone;
  settings.weights.landmark = 10;
  const MorphPlan plan =
      plan_morph({two, {}, {{-1, 0, 0}}}, {two, {}, {{1, 0, 0}}}, FieldKind::kGaussian, settings);
  for (const Pair& pair : plan.pairs) EXPECT_NE(pair.from, pair.to);
}

/// Whether a plan from an object to a copy that is turned about the vertical, and of other shape at
/// one end, turns by so much.
double turn_of(const MorphPlan& plan) {
  return plan.alignment.rotation_vector.y * 57.29577951308232;
}

TEST(TransportPlan, LandmarksDoNotHoldATurnBack) {
  const Mat3 turn = exp_rotation({0, 1.5, 0});
  const std::vector<Ball> a = bar(), b = moved(a, turn, 1, {});
  PlanSettings settings;
  const std::vector<Vec3> from{{0.8f, 0.4f, 0}, {-1, 0, 0}};
  std::vector<Vec3> to;
  for (const Vec3 p : from) to.push_back(to_float(turn * Vec3d(p)));
  const double without =
      turn_of(plan_morph({a, {}, {}}, {b, {}, {}}, FieldKind::kGaussian, settings));
  EXPECT_NEAR(without, 85.9, 1);
  // However much the landmarks weigh.
  for (const float weight : {1.0f, 100.0f}) {
    settings.weights.landmark = weight;
    EXPECT_NEAR(turn_of(plan_morph({a, {}, from}, {b, {}, to}, FieldKind::kGaussian, settings)),
                without, 1);
  }
}

TEST(TransportPlan, ThreeLandmarksGiveTheTurn) {
  // Balls that say nothing of a turn: three in a column.
  const std::vector<Ball> column{ball_at({0, 0, 0}, 0.5f), ball_at({0, 0.4f, 0}, 0.5f),
                                 ball_at({0, 0.8f, 0}, 0.5f)};
  const std::vector<Vec3> from{{0.5f, 0, 0}, {0, 0, 0.5f}, {0, 1.3f, 0}};
  const auto turn_with = [&](double angle, std::size_t count, AlignMethod align) {
    PlanSide a{column, {}, {}}, b{column, {}, {}};
    for (std::size_t l = 0; l < count; ++l) {
      a.landmarks.push_back(from[l]);
      b.landmarks.push_back(to_float(exp_rotation({0, angle, 0}) * Vec3d(from[l])) +
                            Vec3{0.1f, 0, 0});
    }
    PlanSettings settings;
    settings.align = align;
    return plan_morph(a, b, FieldKind::kGaussian, settings).alignment.rotation_vector.y;
  };
  for (const double angle : {0.4, -2.0, 3.0}) {
    EXPECT_NEAR(turn_with(angle, 3, AlignMethod::kSimilarity), angle, 1e-5);
    EXPECT_NEAR(turn_with(angle, 3, AlignMethod::kRigid), angle, 1e-5);
    EXPECT_EQ(turn_with(angle, 3, AlignMethod::kTranslate), 0);
  }
}

TEST(RotationOfLandmarks, NeedsThreeThatAgree) {
  const std::vector<Vec3> from{{1, 0, 0}, {0, 0, 1}, {-1, 0, -1}};
  EXPECT_TRUE(fit_landmark_rotation(from, from));
  EXPECT_FALSE(fit_landmark_rotation(std::span(from).first(2), std::span(from).first(2)));
  const std::vector<Vec3> column{{0, 0, 0}, {0, 1, 0}, {0.01f, 2, 0}};
  EXPECT_FALSE(fit_landmark_rotation(column, from));
  EXPECT_FALSE(fit_landmark_rotation(from, column));
  const std::vector<Vec3> square{{1, 0, 0}, {0, 0, 1}, {-1, 0, 0}, {0, 0, -1}},
      crossed{{1, 0, 0}, {0, 0, -1}, {-1, 0, 0}, {0, 0, 1}};
  EXPECT_FALSE(fit_landmark_rotation(square, crossed)) << "a mirror image is no turn";
}

TEST(BallMasses, AreWhatEachBallEncloses) {
  // Far from each other: their volumes.
  const std::vector<Ball> apart{ball_at({0, 0, 0}, 1), ball_at({10, 0, 0}, 2)};
  const auto masses = ball_masses(apart, FieldKind::kGaussian);
  EXPECT_NEAR(masses[1] / masses[0], 8, 1e-3);
  // Ten in one place share what one would have; the ball beside them has its own.
  std::vector<Ball> crowd(10, ball_at({0, 0, 0}, 1));
  crowd.push_back(ball_at({10, 0, 0}, 1));
  const auto shares = ball_masses(crowd, FieldKind::kGaussian);
  const double grown =
      std::pow(1 + std::log(10.0) / 4, 1.5);  // ten together: sqrt((w + ln 10) / a)
  EXPECT_NEAR(shares[10] / (10 * shares[0]), 1 / grown, 0.05);
  // A ball that nothing of is inside keeps next to nothing.
  Ball hidden = ball_at({20, 0, 0}, 1);
  hidden.w = -3;
  crowd.push_back(hidden);
  EXPECT_LT(ball_masses(crowd, FieldKind::kGaussian)[11], 1e-4);
  EXPECT_GT(ball_masses(crowd, FieldKind::kGaussian)[11], 0);
}

TEST(RadiusOfGyration, IsThatOfTheBodyHoweverManyBallsMakeIt) {
  const std::vector<Ball> one{ball_at({1, 0, 0}, 2)};
  const double solid = std::sqrt(0.6) * 2;
  EXPECT_NEAR(radius_of_gyration({{{1, 0, 0}, 1, 4}}, FieldKind::kInverseSquare, {1, 0, 0}), solid,
              1e-6);
  EXPECT_NEAR(radius_of_gyration(one, FieldKind::kGaussian, {1, 0, 0}), solid, 0.01);
  EXPECT_NEAR(radius_of_gyration(one, FieldKind::kGaussian, {4, 0, 0}),
              std::sqrt(9 + solid * solid), 0.01);
  std::vector<Ball> ten(10, one[0]);
  for (Ball& ball : ten) ball.w -= std::log(10.0f);
  EXPECT_NEAR(radius_of_gyration(ten, FieldKind::kGaussian, {1, 0, 0}), solid, 0.01);
}

/// The points of a surface belong to what their balls are more of.
TEST(Labels, GoWithTheirBallsAndTakeTheTargetsNamesHalfWay) {
  const Creature a = creature(0.9f, 0.9f, 9), b = creature(0.7f, 0.3f, 6);
  PlanSettings settings;
  settings.label_mode = LabelMode::kHard;
  const MorphPlan plan =
      plan_morph({a.balls, a.labels, {}}, {b.balls, b.labels, {}}, FieldKind::kGaussian, settings);
  // The target's limbs have names of their own: 10 more than the source's.
  std::vector<std::uint32_t> from_names, to_names;
  for (const std::int32_t label : a.labels) from_names.push_back(static_cast<std::uint32_t>(label));
  for (const std::int32_t label : b.labels)
    to_names.push_back(static_cast<std::uint32_t>(label) + 10);
  for (const float time : {0.0f, 0.3f, 0.7f, 1.0f}) {
    const std::vector<Ball> balls = balls_at(plan, time);
    std::vector<Vec3> points;
    for (const Ball& ball : balls) points.push_back(ball.center);
    const auto labels =
        label_points({plan, time}, balls, points, {from_names, to_names}, *make_cpu_engine())
            .value();
    std::size_t right = 0;
    for (std::size_t e = 0; e < points.size(); ++e) {
      const Pair& pair = plan.pairs[e];
      right += labels[e] == (time < 0.5f ? from_names[pair.from] : to_names[pair.to]);
    }
    // Where a limb leaves the trunk, the trunk's wider balls weigh more.
    EXPECT_GE(static_cast<double>(right), 0.85 * static_cast<double>(points.size())) << time;
  }
}

TEST(Labels, AreMatchedByTheMapFirstAndThenByTheirNames) {
  const LabelledObject pot{"pot", {"lid", "spout", "body", "handle", "knob"}},
      bird{"bird", {"beak", "body", "wing", "lid", "tail"}};
  const LabelMatch match = match_labels(
      pot, bird, {{"pot.spout", "bird.beak"}, {"wing", "handle"}, {"knob", "bird.wing"}});
  // Two labels that share a partner are one, called by the first of them.
  EXPECT_EQ(match.from, (std::vector<std::int32_t>{0, 1, 2, 3, 3}));
  EXPECT_EQ(match.to, (std::vector<std::int32_t>{1, 2, 3, 0, kNoLabel}));
  // A label that the map names has no partner of its own name.
  const LabelMatch other = match_labels(pot, bird, {{"lid", "tail"}});
  EXPECT_EQ(other.from, (std::vector<std::int32_t>{0, kNoLabel, 2, kNoLabel, kNoLabel}));
  EXPECT_EQ(other.to, (std::vector<std::int32_t>{kNoLabel, 2, kNoLabel, kNoLabel, 0}));
}

TEST(Labels, OfManyNamesEachFindsItsOwn) {
  // Every name beside every other one would be 10^10 comparisons.
  constexpr std::int32_t kCount = 100000;
  LabelledObject from{"one", {}}, to{"other", {}};
  for (std::int32_t i = 0; i < kCount; ++i) {
    from.labels.push_back(std::to_string(i));
    to.labels.push_back(std::to_string(kCount - 1 - i));
  }
  const LabelMatch match = match_labels(from, to, {});
  for (std::int32_t i = 0; i < kCount; ++i) {
    ASSERT_EQ(match.from[static_cast<std::size_t>(i)], i);
    ASSERT_EQ(match.to[static_cast<std::size_t>(i)], kCount - 1 - i);
  }
}

TEST(Labels, WithoutPartnersTheLargerShareWins) {
  const std::vector<Ball> one{ball_at({0, 0, 0}, 1)};
  const MorphPlan plan = plan_morph({one, {}, {}}, {one, {}, {}}, FieldKind::kGaussian, {});
  const std::vector<std::uint32_t> from{1}, to{0};
  const std::vector<Vec3> point{{0.3f, 0, 0}};
  const auto label_at = [&](float time) {
    return label_points({plan, time}, balls_at(plan, time), point, {from, to}, *make_cpu_engine())
        .value()[0];
  };
  EXPECT_EQ(label_at(0.4f), 1u);
  EXPECT_EQ(label_at(0.6f), 0u);
}

}  // namespace
}  // namespace polymorph
