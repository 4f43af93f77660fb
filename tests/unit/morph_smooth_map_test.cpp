#include "morph/smooth_map.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "morph/motion.h"
#include "testing/morph.h"

namespace polymorph {
namespace {

constexpr float kObjectSize = 2.5f;

MorphPlan plan_between(std::vector<Ball> from, std::vector<Ball> to, Path path = Path::kRigid) {
  MotionSettings motion;
  motion.path = path;
  motion.easing = Easing::kLinear;
  PlanSide source, target;
  source.balls = std::move(from);
  target.balls = std::move(to);
  MorphPlan plan =
      plan_morph(std::move(source), std::move(target), FieldKind::kGaussian, {}, motion);
  plan.leads = compute_leads(plan);
  return plan;
}

PullBack pulled(const MorphPlan& plan, float time, const std::vector<Vec3>& points) {
  const auto engine = make_cpu_engine();
  auto out = pull_back(frame_map(plan, time, balls_at(plan, time), kObjectSize), points, *engine);
  EXPECT_TRUE(out.ok()) << out.error().message;
  return out.ok() ? *out : PullBack{};
}

std::vector<Vec3> points_of(const std::vector<Ball>& balls) {
  std::vector<Vec3> points;
  for (const Ball& ball : balls) {
    points.push_back(ball.center);
    points.push_back(ball.center + Vec3{0.1f, -0.15f, 0.05f});
  }
  return points;
}

TEST(SmoothMap, IsTheIdentityAtEitherEnd) {
  for (const Path path : {Path::kStraight, Path::kRigid, Path::kBezier, Path::kParts}) {
    const MorphPlan plan = plan_between(bar(), random_balls(40, 3), path);
    const std::vector<Vec3> from = points_of(plan.from), to = points_of(plan.to);
    const PullBack at_start = pulled(plan, 0, from), at_end = pulled(plan, 1, to);
    for (std::size_t i = 0; i < from.size(); ++i)
      EXPECT_LT(length(at_start.source[i] - from[i]), 1e-5f);
    for (std::size_t i = 0; i < to.size(); ++i) EXPECT_LT(length(at_end.target[i] - to[i]), 1e-5f);
    EXPECT_EQ(at_start.progress[0], 0);
    EXPECT_NEAR(at_end.progress[0], 1, 1e-6f);
  }
}

TEST(SmoothMap, OfATurnedCopyIsThatTurnEverywhere) {
  const Mat3 turn = exp_rotation({0, 0.6, 0.3});
  std::vector<Ball> copy = bar();
  for (Ball& ball : copy) ball.center = to_float(turn * Vec3d(ball.center)) + Vec3{0.3f, 0, 0.1f};
  const MorphPlan plan = plan_between(bar(), copy);
  const std::vector<Ball> half = balls_at(plan, 0.5f);
  const PullBack back = pulled(plan, 0.5f, points_of(half));
  for (std::size_t i = 0; i < back.source.size(); ++i) {
    const Vec3 arrived = to_float(turn * Vec3d(back.source[i])) + Vec3{0.3f, 0, 0.1f};
    EXPECT_LT(length(back.target[i] - arrived), 0.02f);
  }
}

TEST(SmoothMap, NeighboursStayNeighbours) {
  // Whatever the pairs do, points a hundredth of the size apart come from places that are close.
  const MorphPlan plan = plan_between(random_balls(80, 5), random_balls(80, 6));
  std::vector<Vec3> points = points_of(balls_at(plan, 0.5f));
  std::vector<Vec3> beside;
  for (const Vec3 p : points) beside.push_back(p + Vec3{0.01f * kObjectSize, 0, 0});
  const PullBack a = pulled(plan, 0.5f, points), b = pulled(plan, 0.5f, beside);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_LT(length(a.source[i] - b.source[i]), 0.06f * kObjectSize);
}

TEST(SmoothMap, FlowTakesPointsWhereTheyComeFromTheSamePlace) {
  const MorphPlan plan = plan_between(bar(), random_balls(40, 3));
  constexpr float kTime = 0.4f, kNext = 0.42f;
  const std::vector<Ball> balls = balls_at(plan, kTime);
  std::vector<Vec3> points = points_of(balls);
  const auto engine = make_cpu_engine();
  const auto flow = evaluate_flow(
      make_flow_regression({plan, kTime}, {plan, kNext}, balls, kObjectSize), points, *engine);
  ASSERT_TRUE(flow.ok()) << flow.error().message;
  const PullBack before = pulled(plan, kTime, points);
  double moved = 0, missed = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    moved += static_cast<double>(length(flow->displacement[i]));
    points[i] = points[i] + flow->displacement[i];
  }
  const PullBack after = pulled(plan, kNext, points);
  for (std::size_t i = 0; i < points.size(); ++i)
    missed += static_cast<double>(length(after.source[i] - before.source[i]));
  ASSERT_GT(moved, 0);
  EXPECT_LT(missed, moved) << "a point keeps where it comes from better than one that stands still";
}

/// Landmarks of plan_with_landmarks(): the bar's knob and an end become others' places than the
/// balls there do.
const std::vector<Vec3> kFrom{{0.8f, 0.5f, 0}, {-1.15f, 0, 0}, {-0.6f, 0, 0.35f}};
const std::vector<Vec3> kTo{{0.2f, 0.9f, 0.3f}, {0.9f, 0.1f, 0.8f}, {0.1f, 0.1f, 0.9f}};
MorphPlan plan_with_landmarks(Path path, Stagger stagger, bool backwards = false) {
  MotionSettings motion;
  motion.path = path;
  motion.stagger = stagger;
  PlanSide source, target;
  source.balls = bar();
  target.balls = random_balls(40, 3);
  source.landmarks = kFrom;
  target.landmarks = kTo;
  if (backwards) std::swap(source, target);
  return plan_morph(std::move(source), std::move(target), FieldKind::kGaussian, {}, motion);
}

TEST(SmoothMap, LandmarksAreMetOnTheirWay) {
  for (const Path path : {Path::kStraight, Path::kBezier, Path::kRigid, Path::kParts})
    for (const Stagger stagger : {Stagger::kNone, Stagger::kAxis}) {
      const MorphPlan plan = plan_with_landmarks(path, stagger);
      for (const float time : {0.0f, 0.1f, 0.37f, 0.5f, 0.9f, 1.0f}) {
        const std::vector<Vec3> places = landmark_positions(plan, time, balls_at(plan, time));
        const PullBack met = pulled(plan, time, places);
        for (std::size_t l = 0; l < places.size(); ++l) {
          EXPECT_LT(length(met.source[l] - kFrom[l]), 1e-4f * kObjectSize) << time;
          EXPECT_LT(length(met.target[l] - kTo[l]), 1e-4f * kObjectSize) << time;
          if (time == 0) {
            EXPECT_EQ(places[l], kFrom[l]);
          }
          if (time == 1) {
            EXPECT_EQ(places[l], kTo[l]);
          }
        }
      }
    }
}

TEST(SmoothMap, LandmarksGoTheSameWayBackwards) {
  const MorphPlan there = plan_with_landmarks(Path::kRigid, Stagger::kNone),
                  back = plan_with_landmarks(Path::kRigid, Stagger::kNone, true);
  for (const float time : {0.25f, 0.5f}) {
    const auto a = landmark_positions(there, time, balls_at(there, time)),
               b = landmark_positions(back, 1 - time, balls_at(back, 1 - time));
    for (std::size_t l = 0; l < a.size(); ++l) EXPECT_LT(length(a[l] - b[l]), 1e-4f);
  }
}

TEST(SmoothMap, FlowTakesLandmarksAlong) {
  const MorphPlan plan = plan_with_landmarks(Path::kRigid, Stagger::kNone);
  constexpr float kTime = 0.4f, kNext = 0.45f;
  const std::vector<Ball> balls = balls_at(plan, kTime), later = balls_at(plan, kNext);
  const std::vector<Vec3> places = landmark_positions(plan, kTime, balls),
                          next = landmark_positions(plan, kNext, later);
  const auto engine = make_cpu_engine();
  const auto flow = evaluate_flow(
      make_flow_regression({plan, kTime}, {plan, kNext}, balls, kObjectSize), places, *engine);
  ASSERT_TRUE(flow.ok()) << flow.error().message;
  for (std::size_t l = 0; l < places.size(); ++l)
    EXPECT_LT(length(places[l] + flow->displacement[l] - next[l]), 1e-5f);
}

TEST(SmoothMap, LandmarksReachBeyondAllBalls) {
  // A landmark that is drawn far out takes the surface's bounds along.
  MorphPlan plan = plan_with_landmarks(Path::kStraight, Stagger::kNone);
  plan.landmarks[0].to = {0, 4, 0};
  const FrameMap map = frame_map(plan, 0.5f, balls_at(plan, 0.5f), kObjectSize);
  const Vec3 place = map.regression->landmarks[0].position;
  EXPECT_GT(place.y, 2);
  EXPECT_GT(map.box.high.y, place.y);
  const PullBack met = pulled(plan, 0.5f, {place});
  EXPECT_LT(length(met.target[0] - Vec3{0, 4, 0}), 1e-3f);
}

TEST(SmoothMap, HasABoxAroundManyFaintBalls) {
  std::vector<Ball> from = bar(), to = random_balls(40, 3);
  for (std::vector<Ball>* balls : {&from, &to})
    for (Ball& ball : *balls) ball.w -= 8;
  const MorphPlan plan = plan_between(from, to);
  const std::vector<Ball> half = balls_at(plan, 0.5f);
  const Box box = frame_map(plan, 0.5f, half, kObjectSize).box;
  ASSERT_FALSE(box.empty());
  const Ball& strongest = *std::max_element(half.begin(), half.end(),
                                            [](const Ball& a, const Ball& b) { return a.w < b.w; });
  EXPECT_EQ(extend(box, strongest.center).size(), box.size());
}

TEST(SmoothMap, TipsWithoutACounterpartLead) {
  // A bar becomes a ball: its ends are further out than anything there.
  const MorphPlan plan =
      plan_between(bar(), {ball_at({0, 0, 0}, 0.5f), ball_at({0.1f, 0, 0}, 0.5f)});
  float middle = 1, tip = -1;
  for (std::size_t e = 0; e < plan.pairs.size(); ++e) {
    const float x = std::abs(plan.from[plan.pairs[e].from].center.x);
    if (x < 0.1f) middle = std::min(middle, plan.leads[e]);
    if (x > 0.95f) tip = std::max(tip, plan.leads[e]);
  }
  EXPECT_GT(tip, middle + 0.2f);
}

TEST(SmoothMap, LimbsThatPassEachOtherAreNotMixed) {
  const MorphPlan plan = plan_between_columns(0.4f);
  std::vector<Vec3> points;
  for (const Pair& pair : plan.pairs) {
    ASSERT_EQ(plan.from_limbs[pair.from], plan.to_limbs[pair.to]);
    // On the side of the other column.
    const Vec3 p = plan.from[pair.from].center, q = plan.to[pair.to].center;
    points.push_back((p + q) * 0.5f + Vec3{p.x < 0 ? 0.05f : -0.05f, 0, 0});
  }
  const PullBack half = pulled(plan, 0.5f, points);
  for (std::size_t e = 0; e < points.size(); ++e) {
    EXPECT_NEAR(half.source[e].z, plan.from[plan.pairs[e].from].center.z, 0.1f);
    EXPECT_NEAR(half.target[e].z, plan.to[plan.pairs[e].to].center.z, 0.1f);
  }
}

TEST(SmoothMap, IsOnlyFinerWhereLimbsPassEachOther) {
  const auto map_at = [](const MorphPlan& plan, float time) {
    return frame_map(plan, time, balls_at(plan, time), kObjectSize);
  };
  const MorphPlan passing = plan_between_columns(0.4f), standing = plan_between_columns(0);
  const float coarse = map_at(standing, 0.5f).regression->lattice.cell;
  EXPECT_NEAR(coarse, 0.04f * kObjectSize, 1e-5f);
  EXPECT_EQ(map_at(passing, 0).regression->lattice.cell, coarse);
  EXPECT_EQ(map_at(passing, 1).regression->lattice.cell, coarse);
  EXPECT_LT(map_at(passing, 0.5f).regression->lattice.cell, 0.6f * coarse);
}

TEST(Pacing, RunsThroughItsTableWithoutTurningBack) {
  MorphPlan plan = plan_between(bar(), random_balls(40, 3));
  plan.pacing = {0, 0.05f, 0.1f, 0.5f, 0.9f, 1};
  float before = 0;
  for (int k = 0; k <= 100; ++k) {
    const float u = eased_times(plan, static_cast<float>(k) / 100)[0];
    EXPECT_GE(u, before);
    before = u;
  }
  EXPECT_EQ(before, 1);
  EXPECT_NEAR(eased_times(plan, 0.6f)[0], 0.5f, 1e-5f);
}

}  // namespace
}  // namespace polymorph
