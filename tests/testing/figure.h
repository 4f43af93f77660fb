// A standing figure made of balls, for tests of limbs.
#pragma once

#include <cmath>
#include <vector>

#include "testing/morph.h"

namespace polymorph {

/// Returns a standing figure of height 2.4: a trunk, a head on a neck, two legs, and two arms of
/// length 0.9 that rise `arm_angle` radians above the horizontal.
inline std::vector<Ball> figure(float arm_angle = 0) {
  std::vector<Ball> balls;
  for (int i = 0; i <= 5; ++i)
    balls.push_back(ball_at({0, 0.9f + 0.13f * static_cast<float>(i), 0}, 0.28f));
  for (int i = 0; i <= 4; ++i)
    balls.push_back(ball_at({0, 1.75f + 0.1f * static_cast<float>(i), 0}, i < 2 ? 0.12f : 0.22f));
  for (const float side : {-1.0f, 1.0f}) {
    for (int i = 1; i <= 11; ++i) {
      const float t = 0.9f * static_cast<float>(i) / 11;
      balls.push_back(ball_at(
          {side * (0.2f + std::cos(arm_angle) * t), 1.5f + std::sin(arm_angle) * t, 0}, 0.11f));
    }
    for (int i = 1; i <= 9; ++i)
      balls.push_back(ball_at({side * 0.2f, 0.95f - 0.1f * static_cast<float>(i), 0}, 0.13f));
    for (int i = 1; i <= 2; ++i)  // feet point forwards
      balls.push_back(ball_at({side * 0.2f, 0.08f, 0.09f * static_cast<float>(i)}, 0.1f));
  }
  return balls;
}

}  // namespace polymorph
