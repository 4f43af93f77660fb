// Vector math of the renderer: local frames, directions, and trigonometric functions that are
// faster than libm. Templates take one float or eight (simd.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/exact_math.h"
#include "render/math/simd.h"

namespace polymorph {

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kInvPi = std::numbers::inv_pi_v<float>;

template <class V>
PM_HD inline V square(V x) {
  return x * x;
}
/// Clamps to [0, 1]. NaN becomes 0, so that table lookups stay in range.
template <class V>
PM_HD inline V clamp01(V x) {
  return min(max(x, 0.0f), 1.0f);
}
inline float radians(float degrees) { return degrees * (kPi / 180.0f); }
/// Sine, cosine and tangent of an angle in radians, with the same bits on every machine.
inline float sine(float angle) {
  return static_cast<float>(exact::sin(static_cast<double>(angle)));
}
inline float cosine(float angle) {
  return static_cast<float>(exact::cos(static_cast<double>(angle)));
}
inline float tangent(float angle) {
  return static_cast<float>(exact::tan(static_cast<double>(angle)));
}
/// Returns the direction at this azimuth (around y, from z) and elevation, in radians.
inline Vec3 direction_at(float azimuth, float elevation) {
  return {sine(azimuth) * cosine(elevation), sine(elevation), cosine(azimuth) * cosine(elevation)};
}
template <class T3>
PM_HD inline ComponentOf<T3> max_component(T3 a) {
  return max(a.x, max(a.y, a.z));
}
template <class T3>
PM_HD inline ComponentOf<T3> min_component(T3 a) {
  return min(a.x, min(a.y, a.z));
}
template <class T3>
PM_HD inline ComponentOf<T3> luminance(T3 c) {
  return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;  // Rec. 709
}
template <class V>
PM_HD inline V smoothstep(float low, float high, V x) {
  const V t = clamp01((x - low) / (high - low));
  return t * t * (3.0f - 2.0f * t);
}
template <class T3>
PM_HD inline MaskOf<T3> is_black(T3 c) {
  return (c.x == 0.0f) & (c.y == 0.0f) & (c.z == 0.0f);
}
PM_HD inline bool finite(Vec3 a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// An orthonormal frame. At a surface `z` is the normal.
template <class T3>
struct FrameOf {
  T3 x, y, z;
};
using Frame = FrameOf<Vec3>;

/// Branchless frame around a unit vector (Duff et al. 2017, "Building an orthonormal basis,
/// revisited").
template <class T3>
PM_HD inline FrameOf<T3> make_frame(T3 n) {
  using V = ComponentOf<T3>;
  const V sign = copysign(broadcast<V>(1), n.z);
  const V a = -1.0f / (sign + n.z);
  const V b = n.x * n.y * a;
  return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}
/// Transforms to world coordinates, with one frame per lane or one for all lanes.
template <class F3, class T3>
PM_HD inline T3 to_world(const FrameOf<F3>& f, T3 v) {
  return f.x * v.x + f.y * v.y + f.z * v.z;
}
template <class F3, class T3>
PM_HD inline T3 to_local(const FrameOf<F3>& f, T3 v) {
  return {dot(v, f.x), dot(v, f.y), dot(v, f.z)};
}

/// Computes cosine and sine of `turns` full turns, |turns| < 2^20; error below 1e-6.
template <class V>
PM_HD inline Vec2Of<V> cos_sin_turns(V turns) {
  // Subtracts the nearest multiple of a quarter turn, then evaluates Taylor polynomials on [-pi/4,
  // pi/4]. Adding 1.5 * 2^23 rounds to the nearest integer and leaves it in the low bits of the
  // sum.
  constexpr float kRound = 12582912.0f;
  const V shifted = turns * 4.0f + kRound;
  const V x = (turns * 4.0f - (shifted - kRound)) * (kPi / 2);
  const V x2 = x * x;
  const V s = x * (1.0f + x2 * (-1.0f / 6 + x2 * (1.0f / 120 + x2 * (-1.0f / 5040))));
  const V c = 1.0f + x2 * (-0.5f + x2 * (1.0f / 24 + x2 * (-1.0f / 720 + x2 * (1.0f / 40320))));
  const BitsOf<V> quarter = float_bits(shifted);
  // Odd quarters swap sine and cosine. The cosine is negative in quarters 1 and 2, the sine in 2
  // and 3: the shifts move bit 1 to the sign bit.
  const MaskOf<V> odd = (quarter & 1u) != 0u;
  return {xor_sign(((quarter + 1u) & 2u) << 30, select(odd, s, c)),
          xor_sign((quarter & 2u) << 30, select(odd, c, s))};
}

/// Computes atan2(y, x) in turns, (-0.5, 0.5], or 0 if both are 0; error below 1e-5 turns.
template <class V>
PM_HD inline V atan2_turns(V y, V x) {
  const V ax = abs(x), ay = abs(y);
  const V high = max(ax, ay), low = min(ax, ay);
  const V t = low / select(high > 0.0f, high, broadcast<V>(1));
  const V t2 = t * t;
  // Minimax odd polynomial for atan on [0, 1] (Abramowitz & Stegun 4.4.49).
  V a = t * (0.9998660f +
             t2 * (-0.3302995f + t2 * (0.1801410f + t2 * (-0.0851330f + t2 * 0.0208351f))));
  a = a * (0.5f * kInvPi);  // from radians to turns
  a = select(ay > ax, 0.25f - a, a);
  a = select(x < 0.0f, 0.5f - a, a);
  return select(y < 0.0f, -a, a);
}

/// Maps the unit square to the unit disc, area-preserving and continuous (Shirley and Chiu 1997).
template <class V>
PM_HD inline Vec2Of<V> concentric_disc(V u, V v) {
  const V a = 2.0f * u - 1.0f, b = 2.0f * v - 1.0f;
  const MaskOf<V> wide = a * a > b * b;
  const V radius = select(wide, a, b);
  const V ratio = select(wide, b, a) / select(radius == 0.0f, broadcast<V>(1), radius);
  return cos_sin_turns<V>(select(wide, 0.125f * ratio, 0.25f - 0.125f * ratio)) * radius;
}

/// Maps the unit square to directions about +z with the pdf cos / pi.
template <class V>
PM_HD inline Vec3Of<V> cosine_direction(V u, V v) {
  const Vec2Of<V> d = concentric_disc(u, v);
  return {d.x, d.y, sqrt(max(1.0f - d.x * d.x - d.y * d.y, 0.0f))};
}

/// Maps the unit square to directions in the cone about +z of half angle acos(1 - height), uniform
/// in solid angle. The map is continuous, so well-distributed samples stay well distributed.
template <class V, class H>
PM_HD inline Vec3Of<V> cone_direction(H height, V u, V v) {
  const Vec2Of<V> disc = concentric_disc(u, v);
  const V r2 = disc.x * disc.x + disc.y * disc.y;
  // With the disc's radius r: cos = 1 - r^2 height and sin = r sqrt(height (2 - r^2 height));
  // disc.x and disc.y contain the factor r.
  const V scale = sqrt(max(height * (2.0f - r2 * height), 0.0f));
  return {disc.x * scale, disc.y * scale, 1.0f - r2 * height};
}

}  // namespace polymorph
