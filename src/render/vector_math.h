// Small vector helpers of the renderer: frames, directions and the few functions that the inner
// loop calls too often for libm.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "kernels/types.h"

namespace polymorph {

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kInvPi = std::numbers::inv_pi_v<float>;

inline float square(float x) { return x * x; }
/// NaN becomes 0, so that what is looked up with it stays inside its table.
inline float clamp01(float x) { return x > 0 ? (x < 1 ? x : 1.0f) : 0.0f; }
inline float radians(float degrees) { return degrees * (kPi / 180.0f); }
inline float max_component(Vec3 a) { return std::max(a.x, std::max(a.y, a.z)); }
inline float luminance(Vec3 c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }
inline float smoothstep(float low, float high, float x) {
  const float t = clamp01((x - low) / (high - low));
  return t * t * (3 - 2 * t);
}
inline bool finite(Vec3 a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// An orthonormal frame; `z` is the normal.
struct Frame {
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
};

/// Branchless frame around a unit vector (Duff et al. 2017, "Building an orthonormal basis,
/// revisited").
inline Frame make_frame(Vec3 n) {
  const float sign = std::copysign(1.0f, n.z);
  const float a = -1.0f / (sign + n.z);
  const float b = n.x * n.y * a;
  return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}
inline Vec3 to_world(const Frame& f, Vec3 v) { return f.x * v.x + f.y * v.y + f.z * v.z; }
inline Vec3 to_local(const Frame& f, Vec3 v) { return {dot(f.x, v), dot(f.y, v), dot(f.z, v)}; }

/// Cosine and sine of `turns` full turns, |turns| < 2^20; error below 1e-6.
inline Vec2 cos_sin_turns(float turns) {
  // Quarter turns away, then Taylor polynomials on [-pi/4, pi/4].
  const float quarters = std::nearbyint(turns * 4);
  const float x = (turns * 4 - quarters) * (kPi / 2);
  const float x2 = x * x;
  const float s = x * (1 + x2 * (-1.0f / 6 + x2 * (1.0f / 120 + x2 * (-1.0f / 5040))));
  const float c = 1 + x2 * (-0.5f + x2 * (1.0f / 24 + x2 * (-1.0f / 720 + x2 * (1.0f / 40320))));
  switch (static_cast<std::int32_t>(quarters) & 3) {
    case 0:
      return {c, s};
    case 1:
      return {-s, c};
    case 2:
      return {-c, -s};
    default:
      return {s, -c};
  }
}

/// atan2(y, x) in turns, (-0.5, 0.5]; error below 1e-5 turns. 0 where both are 0.
inline float atan2_turns(float y, float x) {
  const float ax = std::fabs(x), ay = std::fabs(y);
  const float high = std::max(ax, ay), low = std::min(ax, ay);
  const float t = high > 0 ? low / high : 0;
  const float t2 = t * t;
  // Minimax odd polynomial for atan on [0, 1] (Abramowitz & Stegun 4.4.49).
  float a = t * (0.9998660f +
                 t2 * (-0.3302995f + t2 * (0.1801410f + t2 * (-0.0851330f + t2 * 0.0208351f))));
  a *= 0.5f * kInvPi;
  if (ay > ax) a = 0.25f - a;
  if (x < 0) a = 0.5f - a;
  return y < 0 ? -a : a;
}

/// Point of the unit disc, area-preserving and continuous (Shirley and Chiu 1997).
inline Vec2 concentric_disc(float u, float v) {
  const float a = 2 * u - 1, b = 2 * v - 1;
  if (a == 0 && b == 0) return {};
  if (a * a > b * b) return cos_sin_turns(0.125f * (b / a)) * a;
  return cos_sin_turns(0.25f - 0.125f * (a / b)) * b;
}

/// Direction about +z with density cos / pi.
inline Vec3 cosine_direction(float u, float v) {
  const Vec2 d = concentric_disc(u, v);
  return {d.x, d.y, std::sqrt(std::max(0.0f, 1 - d.x * d.x - d.y * d.y))};
}

}  // namespace polymorph
