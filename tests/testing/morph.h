// Objects made of balls, without a model, for tests of plans and motions.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "base/matrix_decompositions.h"
#include "base/random.h"
#include "kernels/types.h"
#include "morph/motion.h"
#include "morph/plan.h"

namespace polymorph {

/// Returns a Gaussian ball whose surface, if it is the only ball, has this radius.
inline Ball ball_at(Vec3 center, float radius) { return {center, 4 / (radius * radius), 4}; }

inline std::vector<Ball> random_balls(int n, std::uint64_t seed, Vec3 shift = {}) {
  std::vector<Ball> balls;
  for (int i = 0; i < n; ++i) {
    const auto r = [&](std::uint64_t k) {
      return random_float(seed, k, static_cast<std::uint64_t>(i));
    };
    balls.push_back({Vec3{r(0), r(1), r(2)} + shift, 5 + 20 * r(3), 1 + r(4)});
  }
  return balls;
}

/// Returns a bar along x with a knob along y near one end and one along z near the other, so that
/// only the identity rotates it onto itself.
inline std::vector<Ball> bar() {
  std::vector<Ball> balls;
  for (int i = 0; i <= 16; ++i)
    balls.push_back(ball_at({-1 + 0.125f * static_cast<float>(i), 0, 0}, 0.2f));
  for (int i = 1; i <= 4; ++i)
    balls.push_back(ball_at({0.8f, 0.1f * static_cast<float>(i), 0}, 0.16f));
  for (int i = 1; i <= 2; ++i)
    balls.push_back(ball_at({-0.6f, 0, 0.1f * static_cast<float>(i)}, 0.16f));
  return balls;
}

inline Ball moved(const Ball& ball, const Mat3& rotation, double scale, Vec3d shift) {
  Ball result = ball;
  result.center = to_float(rotation * Vec3d(ball.center) * scale + shift);
  result.a = ball.a / static_cast<float>(scale * scale);
  if (!is_round(ball))
    result.shape = to_sym3(rotation * to_mat3(ball.shape) * transposed(rotation));
  return result;
}

inline std::vector<Ball> moved(std::vector<Ball> balls, const Mat3& rotation, double scale,
                               Vec3d shift) {
  for (Ball& ball : balls) ball = moved(ball, rotation, scale, shift);
  return balls;
}

/// A trunk (label 0) with four limbs (labels 1 to 4); one label per ball.
struct Creature {
  std::vector<Ball> balls;
  std::vector<std::int32_t> labels;
};
/// `spread`: direction of the limbs, from 0, along the trunk's axis y, to 1, sideways.
inline Creature creature(float limb_length, float spread, int balls_per_limb) {
  Creature result;
  for (int i = 0; i <= 6; ++i) {
    result.balls.push_back(ball_at({0, -0.45f + 0.15f * static_cast<float>(i), 0}, 0.3f));
    result.labels.push_back(0);
  }
  for (int limb = 0; limb < 4; ++limb) {
    const float side = limb % 2 ? 1.0f : -1.0f, end = limb < 2 ? 1.0f : -1.0f;
    for (int i = 1; i <= balls_per_limb; ++i) {
      const float t = static_cast<float>(i) / static_cast<float>(balls_per_limb) * limb_length;
      result.balls.push_back(ball_at(
          {side * (0.2f + spread * t), end * (0.45f + (1 - spread) * t), 0.05f * end}, 0.11f));
      result.labels.push_back(limb + 1);
    }
  }
  return result;
}

/// Returns a plan of two columns of balls beside each other, limbs 0 and 1, on straight paths along
/// z. Limb 1 starts 2 `ahead` in front of limb 0 and ends as far behind it; they pass half way.
inline MorphPlan plan_between_columns(float ahead) {
  const auto columns = [](float front) {
    std::vector<Ball> balls;
    for (const float side : {-1.0f, 1.0f})
      for (int i = 0; i < 11; ++i)
        balls.push_back(ball_at({0.1f * side, 0.1f * static_cast<float>(i), side * front}, 0.06f));
    return balls;
  };
  PlanSide from, to;
  from.balls = columns(0), to.balls = columns(0);
  MotionSettings motion;
  motion.path = Path::kStraight;
  motion.easing = Easing::kLinear;
  MorphPlan plan = plan_morph(from, to, FieldKind::kGaussian, {}, motion);
  plan.from = columns(ahead), plan.to = columns(-ahead);
  plan.from_limbs.assign(11, 0);
  plan.from_limbs.resize(22, 1);
  plan.to_limbs = plan.from_limbs;
  set_paths(plan);
  return plan;
}

/// Expects that both plans have the same bits, as their frames must.
inline void expect_same(const MorphPlan& a, const MorphPlan& b) {
  ASSERT_EQ(a.pairs.size(), b.pairs.size());
  EXPECT_EQ(std::memcmp(a.pairs.data(), b.pairs.data(), a.pairs.size() * sizeof(Pair)), 0);
  EXPECT_EQ(std::memcmp(&a.alignment, &b.alignment, sizeof(Alignment)), 0);
  EXPECT_EQ(a.from_masses, b.from_masses);
  EXPECT_EQ(a.to_masses, b.to_masses);
  EXPECT_EQ(a.from_limbs, b.from_limbs);
  EXPECT_EQ(a.to_limbs, b.to_limbs);
  EXPECT_EQ(a.limb_names, b.limb_names);
}

/// Returns the angle of the rotation from `a` to `b`, degrees.
inline double angle_between(const Mat3& a, const Mat3& b) {
  return rotation_angle(transposed(a) * b) * 57.29577951308232;
}

}  // namespace polymorph
