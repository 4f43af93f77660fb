// What one ball contributes at a squared distance, and the ball in the form in which the kernels
// read it.
#pragma once

#include <cstdint>

#include "host_device.h"
#include "math.h"
#include "types.h"

namespace polymorph {

/// A ball with its constants folded, 32 bytes: one aligned load.
struct alignas(32) PreparedBall {
  float x = 0, y = 0, z = 0;
  /// kGaussian: contributes exactly 0 where r^2 > reach2; negative: nowhere at all. Unused
  /// otherwise.
  float reach2 = 0;
  float a = 0;  ///< kGaussian: a log2(e)
  float w = 0;  ///< kGaussian: w log2(e); kInverseSquare: w
  float unused[2] = {0, 0};
};

/// Added to r^2 of kInverseSquare, so that a ball's centre has a finite, large value.
constexpr float kSmallestDistance2 = 1e-20f;

/// `log2_floor` = log2(cutoff iso): the strength at which a Gaussian ball is dropped.
/// Beyond r = sqrt((w - ln(cutoff iso)) / a) (Blinn 1982; report 3.2.3) the ball is culled.
template <FieldKind kKind>
PM_HD inline PreparedBall prepare_ball(const Ball& ball, float log2_floor) {
  constexpr float kLog2E = 1.44269504f;
  PreparedBall out;
  out.x = ball.center.x;
  out.y = ball.center.y;
  out.z = ball.center.z;
  if (kKind == FieldKind::kGaussian) {
    out.a = ball.a * kLog2E;
    out.w = least(ball.w * kLog2E, kLargestExponent);
    out.reach2 = (out.w - log2_floor) / out.a;
  } else {
    out.w = ball.w;
  }
  return out;
}

PM_HD inline float squared(float x, float y, float z) { return fused(z, z, fused(y, y, x * x)); }

/// The contribution at squared distance r2. Falls with r2 (rises for w < 0) up to rounding.
template <FieldKind kKind>
PM_HD inline float falloff(const PreparedBall& ball, float r2) {
  if (kKind == FieldKind::kGaussian) {
    // Within reach the exponent lies between log2(cutoff iso) and w, inside the range of
    // power_of_two().
    return kept_if(r2 <= ball.reach2, power_of_two(fused(-ball.a, r2, ball.w)));
  }
  return ball.w * (1.0f / (r2 + kSmallestDistance2));
}

/// -d falloff / d(r2), up to one positive factor common to all balls.
template <FieldKind kKind>
PM_HD inline float falloff_slope(const PreparedBall& ball, float r2) {
  if (kKind == FieldKind::kGaussian) return ball.a * falloff<kKind>(ball, r2);
  const float inverse = 1.0f / (r2 + kSmallestDistance2);
  return ball.w * inverse * inverse;
}

}  // namespace polymorph
