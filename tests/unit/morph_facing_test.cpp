#include "morph/facing.h"

#include <gtest/gtest.h>

#include "base/exact_math.h"
#include "morph/align.h"
#include "morph/plan.h"
#include "testing/figure.h"

namespace polymorph {
namespace {

/// A four-legged animal that looks along +x, with a head on a raised neck and a thin tail.
std::vector<Ball> animal(float length, float neck) {
  std::vector<Ball> balls;
  for (int i = 0; i <= 6; ++i)
    balls.push_back(ball_at({length * (static_cast<float>(i) / 6 - 0.5f), 1.2f, 0}, 0.3f));
  for (int i = 1; i <= 5; ++i) {
    const float t = static_cast<float>(i) / 5;
    balls.push_back(ball_at({0.5f * length + 0.4f * t, 1.3f + neck * t, 0}, i < 4 ? 0.15f : 0.22f));
    balls.push_back(ball_at({-0.5f * length - 0.5f * t, 1.3f, 0}, 0.1f));
  }
  for (const float end : {-0.4f, 0.4f})
    for (const float side : {-0.22f, 0.22f})
      for (int i = 1; i <= 8; ++i)
        balls.push_back(
            ball_at({end * length, 1.1f - 0.125f * static_cast<float>(i), side}, 0.12f));
  return balls;
}

std::vector<Ball> ring() {
  std::vector<Ball> balls;
  for (int i = 0; i < 24; ++i) {
    const double angle = 2 * exact::kPi * i / 24;
    balls.push_back(ball_at(
        {static_cast<float>(exact::cos(angle)), 1, static_cast<float>(exact::sin(angle))}, 0.3f));
  }
  return balls;
}

std::vector<Ball> turn(const std::vector<Ball>& balls, double angle) {
  return moved(balls, exp_rotation({0, angle, 0}), 1, {});
}

double difference(double a, double b) {
  return std::fabs(exact::atan2(exact::sin(a - b), exact::cos(a - b)));
}

constexpr double kDegree = exact::kPi / 180;

TEST(Facing, AnimalsThatLookElsewhereTurn) {
  const Limbs from = find_limbs(animal(2, 0.9f));
  for (const double degrees : {0.0, 45.0, 90.0, 180.0, -120.0}) {
    const Limbs to = find_limbs(turn(animal(1.4f, 0.5f), degrees * kDegree));
    LimbPlan limbs{from, to};
    const auto angle = find_facing(limbs, 0);
    ASSERT_TRUE(angle) << degrees;
    EXPECT_LT(difference(*angle, degrees * kDegree), 15 * kDegree) << degrees;
  }
}

TEST(Facing, FiguresTurnByTheirFeet) {
  const Limbs from = find_limbs(figure(-0.6f));
  for (const double degrees : {0.0, 90.0, 180.0}) {
    const Limbs to = find_limbs(turn(figure(0.3f), degrees * kDegree));
    LimbPlan limbs{from, to};
    const auto angle = find_facing(limbs, 0);
    ASSERT_TRUE(angle) << degrees;
    EXPECT_LT(difference(*angle, degrees * kDegree), 15 * kDegree) << degrees;
  }
}

/// The figure with a belly in front. `foot`: factor of the length of its feet; negative if they
/// point backwards.
std::vector<Ball> figure_with_belly(float foot, float belly) {
  std::vector<Ball> balls = figure(0.3f);
  for (Ball& ball : balls)
    if (ball.center.y < 0.1f) ball.center.z *= foot;
  balls.push_back(ball_at({0, 1.2f, belly}, 0.3f));
  return balls;
}

TEST(Facing, BodiesOutweighLimbsThatHardlyDiffer) {
  for (const bool has_long_feet : {false, true}) {
    const float foot = has_long_feet ? 1.4f : 0.9f;
    LimbPlan limbs{find_limbs(figure_with_belly(foot, 0.2f)),
                   find_limbs(figure_with_belly(-foot, 0.2f))};
    const LimbMatch front = match_at(limbs, 0),
                    back = match_at(limbs, log_rotation(about_vertical(exact::kPi)).y);
    ASSERT_TRUE(is_certain(front) && is_certain(back));
    ASSERT_LT(back.cost, front.cost);  // the feet of the one point forwards, the other's backwards
    const auto angle = find_facing(limbs, 0);
    ASSERT_TRUE(angle);
    EXPECT_LT(difference(*angle, has_long_feet ? exact::kPi : 0), 15 * kDegree) << foot;
  }
}

TEST(Facing, HeedsLandmarks) {
  PlanSide from{figure(0.3f), {}, {}}, to{figure(0.3f), {}, {}};
  const auto find = [&] {
    LimbPlan limbs = find_limbs_of_sides(from, to, PlanSettings{});
    return find_facing(limbs, 0).value_or(-1);
  };
  EXPECT_EQ(find(), 0);
  // Only from behind each hand and foot is the other one.
  const Vec3 hand{1, 1.75f, 0}, foot{0.2f, 0.08f, 0};
  for (const Vec3 place : {hand, foot})
    for (const float side : {-1.0f, 1.0f}) {
      from.landmarks.push_back({side * place.x, place.y, place.z});
      to.landmarks.push_back({-side * place.x, place.y, place.z});
    }
  EXPECT_LT(difference(find(), exact::kPi), 15 * kDegree);
}

TEST(Facing, MatchesEachTurnOnce) {
  LimbPlan limbs{find_limbs(animal(2, 0.9f)), find_limbs(turn(animal(1.4f, 0.5f), 1))};
  const auto angle = find_facing(limbs, 0);
  ASSERT_TRUE(angle);
  EXPECT_EQ(limbs.matches_by_angle.size(), 2u);
  // A plan asks from the rotation that it turns by.
  const LimbMatch again = match_at(limbs, log_rotation(about_vertical(*angle)).y);
  EXPECT_EQ(limbs.matches_by_angle.size(), 2u);
  EXPECT_EQ(again.cost,
            match_limbs(limbs.from, limbs.to, log_rotation(about_vertical(*angle)).y).cost);
}

TEST(Facing, WhatHasNoFrontDoesNotTurn) {
  LimbPlan limbs{find_limbs(ring()), find_limbs(animal(2, 0.9f))};
  EXPECT_FALSE(find_facing(limbs, 0));
}

/// Balls in a row along x without limbs. Their radii grow towards +x by `growth` of the middle one.
std::vector<Ball> cone(float growth) {
  std::vector<Ball> balls;
  for (int i = 0; i <= 8; ++i) {
    const float x = 0.25f * static_cast<float>(i) - 1;
    balls.push_back(ball_at({x, 1, 0}, 0.3f * (1 + growth * x)));
  }
  return balls;
}

/// A horizontal V of balls that points to +x.
std::vector<Ball> wedge(float bend) {
  std::vector<Ball> balls;
  for (int i = -4; i <= 4; ++i) {
    const float z = 0.25f * static_cast<float>(i);
    balls.push_back(ball_at({-bend * std::fabs(z), 1, z}, 0.3f));
  }
  return balls;
}

TEST(Facing, UndecidedFrontsTurnForAClearGainOnly) {
  const auto find = [](const std::vector<Ball>& from, const std::vector<Ball>& to) {
    LimbPlan limbs{find_limbs(from), find_limbs(to)};
    const auto angle = find_facing(limbs, 0);
    EXPECT_TRUE(angle);
    return angle.value_or(-1);
  };
  // A thick end is hardly more like the point of a V than like its open side: one of these two
  // would turn if any gain sufficed.
  EXPECT_LT(difference(find(cone(0.4f), wedge(0.7f)), 0), kDegree);
  EXPECT_LT(difference(find(cone(0.4f), turn(wedge(0.7f), exact::kPi)), 0), kDegree);
  EXPECT_LT(difference(find(cone(0.4f), turn(cone(0.5f), exact::kPi)), exact::kPi), kDegree);
}

TEST(Facing, FrontsThatAreKnownDecide) {
  LimbPlan limbs{find_limbs(animal(2, 0.9f)), find_limbs(ring())};
  const auto both = find_facing(limbs, 0, 90 * kDegree, -30 * kDegree);
  ASSERT_TRUE(both);
  EXPECT_LT(difference(*both, -120 * kDegree), 1e-9);
}

TEST(Facing, LimbsOfTurnedFiguresKeepTheirNames) {
  const double angle = 150 * kDegree;
  LimbPlan plan = find_limbs_of_sides({figure(), {}, {}}, {turn(figure(0.3f), angle), {}, {}}, {});
  plan.match = match_at(plan, angle);
  const auto names = list_limb_names(plan, angle);
  EXPECT_EQ(names.size(), 5u);
  for (const auto& [from, to] : names) EXPECT_EQ(from, to);
}

TEST(Facing, PlansNameLimbsInOneFrame) {
  const std::vector<Ball> a = animal(2, 0.9f), b = turn(animal(0.9f, 1.4f), exact::kPi);
  const MorphPlan plan = plan_morph({a, {}, {}}, {b, {}, {}}, FieldKind::kGaussian, {});
  ASSERT_LT(difference(plan.alignment.rotation_vector.y, exact::kPi), 25 * kDegree);
  EXPECT_GE(plan.limb_names.size(), 5u);
  for (const auto& [from, to] : plan.limb_names) EXPECT_EQ(from, to);
}

TEST(Facing, PlansTurnByIt) {
  const std::vector<Ball> a = animal(2, 0.9f), b = turn(animal(1.4f, 0.5f), exact::kPi);
  const MorphPlan plan = plan_morph({a, {}, {}}, {b, {}, {}}, FieldKind::kGaussian, {});
  EXPECT_LT(difference(plan.alignment.rotation_vector.y, exact::kPi), 15 * kDegree);
  PlanSide source{a, {}, {}}, target{b, {}, {}};
  source.front = 90 * kDegree, target.front = 60 * kDegree;
  const MorphPlan given = plan_morph(source, target, FieldKind::kGaussian, {});
  EXPECT_LT(difference(given.alignment.rotation_vector.y, -30 * kDegree), 1e-6);
}

}  // namespace
}  // namespace polymorph
