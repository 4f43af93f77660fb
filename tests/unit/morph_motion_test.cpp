#include "morph/motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "morph/flow.h"
#include "morph/pull_back.h"
#include "testing/morph.h"

namespace polymorph {
namespace {

MorphPlan plan_motion(const std::vector<Ball>& a, const std::vector<Ball>& b,
                      const MotionSettings& motion = {}, const PlanSettings& settings = {}) {
  return plan_morph({a, {}, {}}, {b, {}, {}}, FieldKind::kGaussian, settings, motion);
}

MotionSettings linear(Path path) {
  MotionSettings motion;
  motion.path = path;
  motion.easing = Easing::kLinear;
  return motion;
}

/// An ellipsoid with axes 1 : 2 : 3, turned.
Ball ellipsoid(Vec3 center, float radius, Vec3d turn) {
  Ball ball = ball_at(center, radius);
  const Mat3 rotation = exp_rotation(turn);
  const double mean = std::cbrt(1.0 / 36);
  Mat3 axes{{1 / mean, 0, 0, 0, 1 / (4 * mean), 0, 0, 0, 1 / (9 * mean)}};
  const double root = std::cbrt(axes.m[0] * axes.m[4] * axes.m[8]);
  for (double& v : axes.m) v /= root;
  ball.shape = to_sym3(rotation * axes * transposed(rotation));
  return ball;
}

TEST(BallsAt, TheEndsAreTheBallsOwnNumbersToTheBit) {
  std::vector<Ball> a = random_balls(20, 1), b = random_balls(30, 2, {2, 0, 0});
  for (std::size_t i = 0; i < 5; ++i) {
    a[i] = ellipsoid(a[i].center, 0.3f, {0.1, 0.2, 0.3});
    b[i + 3] = ellipsoid(b[i + 3].center, 0.2f, {1, 0, 0.3});
  }
  for (const Path path : {Path::kStraight, Path::kBezier, Path::kRigid, Path::kExplode}) {
    const MorphPlan plan = plan_motion(a, b, linear(path));
    for (const float time : {0.0f, 1.0f}) {
      const std::vector<Ball> balls = balls_at(plan, time);
      for (std::size_t e = 0; e < balls.size(); ++e) {
        const Ball& own = time == 0 ? a[plan.pairs[e].from] : b[plan.pairs[e].to];
        EXPECT_EQ(balls[e].center, own.center);
        EXPECT_EQ(balls[e].a, own.a);
        EXPECT_EQ(balls[e].shape, own.shape);
      }
    }
  }
}

TEST(BallsAt, MotionIsContinuousAtTheEnds) {
  std::vector<Ball> a = random_balls(20, 1), b = random_balls(30, 2, {2, 0, 0});
  a[3] = ellipsoid(a[3].center, 0.3f, {0.1, 0.2, 0.3});
  for (const Path path : {Path::kStraight, Path::kBezier, Path::kRigid, Path::kExplode}) {
    const MorphPlan plan = plan_motion(a, b, linear(path));
    for (const auto& [end, near] : {std::pair{0.0f, 1e-6f}, {1.0f, 1 - 1e-6f}}) {
      const auto at = balls_at(plan, end), beside = balls_at(plan, near);
      for (std::size_t e = 0; e < at.size(); ++e) {
        EXPECT_NEAR(beside[e].a / at[e].a, 1, 1e-4);
        EXPECT_LT(length(beside[e].center - at[e].center), 1e-4f);
        EXPECT_NEAR(beside[e].w, at[e].w, 1e-4);
        EXPECT_NEAR(beside[e].shape.xx, at[e].shape.xx, 1e-3);
        EXPECT_NEAR(beside[e].shape.yz, at[e].shape.yz, 1e-3);
      }
    }
  }
}

TEST(BallsAt, ARigidPathIsATurnedCopyAtEveryTime) {
  std::vector<Ball> a = bar();
  for (std::size_t i = 0; i < a.size(); i += 3)
    a[i] = ellipsoid(a[i].center, 0.2f, {0.3 * static_cast<double>(i), 1, 0});
  const Vec3d turn = normalized(Vec3d{1, 2, 0.5}) * (2.0 * std::numbers::pi / 3);
  const std::vector<Ball> b = moved(a, exp_rotation(turn), 2, {3, 0, 1});
  const MorphPlan plan = plan_motion(a, b, linear(Path::kRigid));
  double own_mass = 0;
  for (const Pair& pair : plan.pairs) own_mass += pair.from == pair.to ? pair.mass : 0;
  ASSERT_GT(own_mass, 0.97);
  ASSERT_EQ(plan.pairs[0].from, plan.pairs[0].to);
  for (const double u : {0.25, 0.5, 0.8}) {
    const std::vector<Ball> balls = balls_at(plan, static_cast<float>(u));
    const Mat3 rotation = exp_rotation(turn * u);
    const double scale = std::pow(2, u);
    for (std::size_t e = 1; e < balls.size(); ++e) {
      if (plan.pairs[e].from != plan.pairs[e].to) continue;  // a part that goes next door
      const Ball& own = a[plan.pairs[e].from];
      // Distances from the first ball, so that the path of the whole does not matter.
      const Vec3d wanted =
          rotation * (Vec3d(own.center) - Vec3d(a[plan.pairs[0].from].center)) * scale;
      const Vec3d got = Vec3d(balls[e].center) - Vec3d(balls[0].center);
      EXPECT_LT(length(got - wanted), 2e-3) << u;
      const Ball turned = moved(own, rotation, scale, {});
      EXPECT_NEAR(balls[e].shape.xx, turned.shape.xx, 5e-3);
      EXPECT_NEAR(balls[e].shape.xz, turned.shape.xz, 5e-3);
    }
  }
}

TEST(PullBack, FindsWhereAPointCameFromAndGoesTo) {
  std::vector<Ball> a = bar();
  for (std::size_t i = 0; i < a.size(); i += 3)
    a[i] = ellipsoid(a[i].center, 0.2f, {0.3 * static_cast<double>(i), 1, 0});
  const Vec3d turn = normalized(Vec3d{1, 2, 0.5}) * (2.0 * std::numbers::pi / 3);
  const Mat3 rotation = exp_rotation(turn);
  const std::vector<Ball> b = moved(a, rotation, 2, {3, 0, 1});
  const MorphPlan plan = plan_motion(a, b, linear(Path::kRigid));
  std::vector<Vec3> on_a;
  for (const Ball& ball : a)
    for (const Vec3 d : {Vec3{0.1f, 0, 0}, Vec3{0, 0.15f, 0.05f}, Vec3{-0.05f, 0, 0.1f}})
      on_a.push_back(ball.center + d);
  const auto engine = make_cpu_engine();
  const PullBack start = pull_back(plan, 0, balls_at(plan, 0), on_a, *engine).value();
  for (std::size_t i = 0; i < on_a.size(); ++i) {
    EXPECT_LT(length(start.source[i] - on_a[i]), 1e-4f) << "at its own end a point is itself";
    const Vec3d goes = rotation * (Vec3d(on_a[i]) * 2) + Vec3d{3, 0, 1};
    EXPECT_LT(length(Vec3d(start.target[i]) - goes), 0.12) << "the copy's, but for split balls";
  }
  const PullBack end = pull_back(plan, 1, balls_at(plan, 1), start.target, *engine).value();
  for (std::size_t i = 0; i < on_a.size(); ++i)
    EXPECT_LT(length(end.target[i] - start.target[i]), 1e-4f);
}

TEST(Flow, FollowsATurningBodyAndKnowsItsShare) {
  const Vec3d turn{0, 0, 1.2};
  const std::vector<Ball> a = bar(), b = moved(a, exp_rotation(turn), 1.3, {0.5, 0.2, 0});
  const MorphPlan plan = plan_motion(a, b, linear(Path::kRigid));
  const float time = 0.4f, next = 0.5f;
  std::vector<Vec3> points;
  for (const Ball& ball : balls_at(plan, time)) points.push_back(ball.center + Vec3{0, 0.05f, 0});
  const auto engine = make_cpu_engine();
  const Flow flow =
      flow_at({plan, time}, {plan, next}, balls_at(plan, time), points, *engine).value();
  // Of a similarity the flow is the similarity; distances from the first point, so that the path of
  // the whole does not matter.
  const Mat3 part = exp_rotation(turn * 0.1);
  const double growth = std::pow(1.3, 0.1);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec3d now = Vec3d(points[i]) - Vec3d(points[0]);
    const Vec3d then = now + Vec3d(flow.displacement[i]) - Vec3d(flow.displacement[0]);
    EXPECT_LT(length(then - part * now * growth), 0.01) << i;
    EXPECT_NEAR(flow.progress[i], time, 1e-5f);
  }
  EXPECT_GT(length(flow.displacement[0]), 0.03f);
  const Flow still =
      flow_at({plan, time}, {plan, time}, balls_at(plan, time), points, *engine).value();
  for (const Vec3& d : still.displacement) EXPECT_EQ(length(d), 0);
}

TEST(BallsAt, BezierPathsGoInOneArcAndStraightOnesDoNot) {
  // The ways are 3 and 1 long: sqrt(5) in the root mean square.
  const std::vector<Ball> a{ball_at({-2, 1, 0}, 0.2f), ball_at({-1, -1, 0}, 0.2f)};
  const std::vector<Ball> b{ball_at({1, 1, 0}, 0.2f), ball_at({0, -1, 0}, 0.2f)};
  const auto straight = balls_at(plan_motion(a, b, linear(Path::kStraight)), 0.5f);
  const auto arc = balls_at(plan_motion(a, b, linear(Path::kBezier)), 0.5f);
  for (std::size_t e = 0; e < 2; ++e) {
    EXPECT_NEAR(std::abs(straight[e].center.y), 1, 1e-5);
    EXPECT_NEAR(arc[e].center.y - straight[e].center.y, 0.25f * std::sqrt(5.0f), 1e-5);
    EXPECT_NEAR(arc[e].center.x, straight[e].center.x, 1e-5);
  }
}

TEST(BallsAt, BackwardsIsTheSameMorphReversed) {
  std::vector<Ball> a = random_balls(25, 1), b = random_balls(35, 2, {1, 0, 0});
  a[2] = ellipsoid(a[2].center, 0.3f, {0.1, 0.2, 0.3});
  PlanSettings settings;
  settings.weights.align_gain = 0.01f;
  for (const Path path : {Path::kStraight, Path::kBezier, Path::kRigid, Path::kExplode}) {
    MotionSettings motion;
    motion.path = path;
    const MorphPlan there = plan_motion(a, b, motion, settings),
                    back = plan_motion(b, a, motion, settings);
    for (const float time : {0.0f, 0.125f, 0.375f, 0.5f, 1.0f}) {
      const auto one = balls_at(there, time), two = balls_at(back, 1 - time);
      ASSERT_EQ(one.size(), two.size());
      for (std::size_t e = 0; e < one.size(); ++e) {
        EXPECT_LT(length(one[e].center - two[e].center), 2e-5f);
        EXPECT_NEAR(one[e].a / two[e].a, 1, 1e-5);
        EXPECT_NEAR(one[e].w, two[e].w, 1e-5);
        EXPECT_NEAR(one[e].shape.xy, two[e].shape.xy, 1e-4);
      }
    }
  }
}

TEST(BallsAt, HalfATurnComesBackTheWayItWent) {
  const std::vector<Ball> a = bar();
  const auto b = moved(a, exp_rotation(Vec3d{0, 0, std::numbers::pi}), 1, {});
  const MorphPlan there = plan_motion(a, b), back = plan_motion(b, a);
  const auto one = balls_at(there, 0.5f), two = balls_at(back, 0.5f);
  for (std::size_t e = 0; e < one.size(); ++e)
    EXPECT_LT(length(one[e].center - two[e].center), 1e-4f);
}

TEST(BallsAt, AnExplosionThrowsBallsApartAndNoneThroughTheFloor) {
  const std::vector<Ball> a = random_balls(40, 1), b = random_balls(40, 2);
  float lowest = 1;
  for (const auto& balls : {a, b})
    for (const Ball& ball : balls) lowest = std::min(lowest, ball.center.y);
  const auto spread = [](const std::vector<Ball>& balls) {
    Vec3 middle;
    float sum = 0;
    for (const Ball& ball : balls) middle = middle + ball.center / static_cast<float>(balls.size());
    for (const Ball& ball : balls) sum += length(ball.center - middle);
    return sum / static_cast<float>(balls.size());
  };
  MotionSettings motion = linear(Path::kExplode);
  const MorphPlan plan = plan_motion(a, b, motion);
  EXPECT_GT(spread(balls_at(plan, 0.5f)), 1.5f * spread(a));
  for (int i = 0; i <= 20; ++i)
    for (const Ball& ball : balls_at(plan, static_cast<float>(i) / 20))
      EXPECT_GE(ball.center.y, lowest - 1e-4f);
  motion.seed = 7;
  EXPECT_GT(
      length(balls_at(plan_motion(a, b, motion), 0.5f)[0].center - balls_at(plan, 0.5f)[0].center),
      1e-3f);
}

TEST(Stagger, TheLastBallStartsWhenTheShareIsOver) {
  const std::vector<Ball> a = bar(), b = moved(bar(), {}, 1, {0, 5, 0});
  MotionSettings motion = linear(Path::kStraight);
  motion.stagger = Stagger::kAxis;
  motion.stagger_axis = {1, 0, 0};
  motion.stagger_share = 0.5f;
  const MorphPlan plan = plan_motion(a, b, motion);
  const auto rest = balls_at(plan, 0), early = balls_at(plan, 0.25f), late = balls_at(plan, 0.75f);
  for (std::size_t e = 0; e < rest.size(); ++e) {
    const float order = (plan.from[plan.pairs[e].from].center.x + 1) / 2;  // the bar is [-1, 1]
    const float moved_early = early[e].center.y - rest[e].center.y;
    EXPECT_NEAR(moved_early, 5 * std::clamp((0.25f - 0.5f * order) / 0.5f, 0.0f, 1.0f), 0.02);
    const float moved_late = late[e].center.y - rest[e].center.y;
    EXPECT_NEAR(moved_late, 5 * std::clamp((0.75f - 0.5f * order) / 0.5f, 0.0f, 1.0f), 0.02);
  }
}

TEST(Stagger, AllKindsArriveAndNoiseDependsOnTheSeed) {
  const std::vector<Ball> a = random_balls(20, 1), b = random_balls(30, 2);
  std::vector<Ball> middle;
  for (const Stagger stagger :
       {Stagger::kAxis, Stagger::kRadius, Stagger::kLabel, Stagger::kNoise}) {
    MotionSettings motion;
    motion.stagger = stagger;
    const MorphPlan plan = plan_motion(a, b, motion);
    const auto end = balls_at(plan, 1);
    for (std::size_t e = 0; e < end.size(); ++e)
      EXPECT_EQ(end[e].center, b[plan.pairs[e].to].center);
    EXPECT_EQ(progress_at(plan, 0), 0);
    EXPECT_EQ(progress_at(plan, 1), 1);
  }
  MotionSettings motion;
  motion.stagger = Stagger::kNoise;
  const auto one = balls_at(plan_motion(a, b, motion), 0.4f);
  motion.seed = 1;
  const auto two = balls_at(plan_motion(a, b, motion), 0.4f);
  float differs = 0;
  for (std::size_t e = 0; e < one.size(); ++e)
    differs = std::max(differs, length(one[e].center - two[e].center));
  EXPECT_GT(differs, 0.01f);
}

TEST(Spring, BigBallsLagBehindSmallOnes) {
  const std::vector<Ball> a{ball_at({0, 0, 0}, 0.5f), ball_at({0, 3, 0}, 0.1f)};
  const auto b = moved(a, {}, 1, {5, 0, 0});
  MotionSettings motion = linear(Path::kStraight);
  motion.easing = Easing::kSpring;
  const MorphPlan plan = plan_motion(a, b, motion);
  const auto balls = balls_at(plan, 0.1f);
  ASSERT_EQ(balls.size(), 2u);
  EXPECT_LT(balls[0].center.x + 0.1f, balls[1].center.x);
}

TEST(Parts, AreExactAtBothEndsAndDeterministic) {
  const Creature a = creature(0.9f, 0.9f, 9), b = creature(0.7f, 0.3f, 6);
  MotionSettings motion;
  motion.path = Path::kParts;
  for (const bool labelled : {true, false}) {
    for (const Stagger stagger : {Stagger::kNone, Stagger::kNoise}) {
      motion.stagger = stagger;
      const auto labels = [&](const Creature& c) {
        return labelled ? c.labels : std::vector<std::int32_t>{};
      };
      const MorphPlan plan = plan_morph({a.balls, labels(a), {}}, {b.balls, labels(b), {}},
                                        FieldKind::kGaussian, {}, motion);
      EXPECT_GE(plan.parts.size(), 2u);
      for (const auto& [time, ends] : {std::pair(0.0f, &plan.from), std::pair(1.0f, &plan.to)}) {
        const auto at = balls_at(plan, time),
                   near = balls_at(plan, time + (time > 0 ? -1 : 1) * 0.02f);
        for (std::size_t e = 0; e < at.size(); ++e) {
          const Ball& end = (*ends)[time > 0 ? plan.pairs[e].to : plan.pairs[e].from];
          EXPECT_EQ(length(at[e].center - end.center), 0);
          EXPECT_LT(length(near[e].center - end.center), 0.01f) << "and nearly so near them";
        }
      }
      const auto once = balls_at(plan, 0.4f), again = balls_at(plan, 0.4f);
      for (std::size_t e = 0; e < once.size(); ++e)
        EXPECT_EQ(length(once[e].center - again[e].center), 0);
    }
  }
}

TEST(Parts, OfACopyMoveAsTheWholeDoes) {
  const std::vector<Ball> a = bar();
  const Mat3 turn = exp_rotation(Vec3d{0.3, 0.9, 0.5});
  const std::vector<Ball> b = moved(a, turn, 1.3, {1, 0, 2});
  MotionSettings motion;
  const MorphPlan rigid = plan_morph({a, {}, {}}, {b, {}, {}}, FieldKind::kGaussian, {}, motion);
  motion.path = Path::kParts;
  const MorphPlan parts = plan_morph({a, {}, {}}, {b, {}, {}}, FieldKind::kGaussian, {}, motion);
  for (const float time : {0.2f, 0.5f, 0.8f}) {
    const auto x = balls_at(rigid, time), y = balls_at(parts, time);
    ASSERT_EQ(x.size(), y.size());
    for (std::size_t e = 0; e < x.size(); ++e)
      EXPECT_LT(length(x[e].center - y[e].center), 0.05f) << time;
  }
}

TEST(Parts, BackwardsAreTheSame) {
  const Creature a = creature(0.9f, 0.9f, 9), b = creature(0.7f, 0.3f, 6);
  MotionSettings motion;
  motion.path = Path::kParts;
  const MorphPlan there = plan_morph({a.balls, a.labels, {}}, {b.balls, b.labels, {}},
                                     FieldKind::kGaussian, {}, motion);
  const MorphPlan back = plan_morph({b.balls, b.labels, {}}, {a.balls, a.labels, {}},
                                    FieldKind::kGaussian, {}, motion);
  ASSERT_EQ(there.pairs.size(), back.pairs.size());
  for (const float time : {0.25f, 0.5f, 0.7f}) {
    const auto x = balls_at(there, time), y = balls_at(back, 1 - time);
    for (std::size_t e = 0; e < x.size(); ++e)
      EXPECT_LT(length(x[e].center - y[e].center), 2e-3f) << time;
  }
}

}  // namespace
}  // namespace polymorph
