// The GGX distribution in a local frame (z = normal), isotropic.
#pragma once

#include <algorithm>
#include <cmath>

#include "render/vector_math.h"

namespace polymorph {

inline constexpr float kLeastAlpha = 1e-3f;  // a mirror, as far as float arithmetic can tell

/// Density of microfacet normals.
inline float ggx_density(Vec3 half, float alpha) {
  // (h.x^2 + h.y^2) / a^2 + h.z^2 keeps its digits for sharp lobes, where h.z^2 (a^2 - 1) + 1 does
  // not.
  const float a2 = alpha * alpha;
  const float e = (half.x * half.x + half.y * half.y) / a2 + half.z * half.z;
  return kInvPi / (a2 * e * e);
}
/// Smith's Lambda plus terms, as sqrt(a^2 + (1 - a^2) c^2).
inline float ggx_root(float cosine, float alpha) {
  const float a2 = alpha * alpha;
  return std::sqrt(a2 + (1 - a2) * cosine * cosine);
}
/// Share of microfacets seen from a direction.
inline float ggx_masking(float cosine, float alpha) {
  return 2 * cosine / (cosine + ggx_root(cosine, alpha));
}
/// G2 / (4 cos_a cos_b), height-correlated (Heitz 2014).
inline float ggx_visibility(float a, float b, float alpha) {
  return 0.5f / (a * ggx_root(b, alpha) + b * ggx_root(a, alpha));
}
/// Density, per solid angle, of the direction mirrored at a visible normal.
inline float ggx_direction_density(Vec3 view, Vec3 half, float alpha) {
  return ggx_density(half, alpha) / (2 * (view.z + ggx_root(view.z, alpha)));
}
/// A microfacet normal as seen from `view` (Dupuy and Benyoub 2023, spherical caps).
inline Vec3 sample_ggx_normal(Vec3 view, float alpha, float u, float v) {
  const Vec3 stretched = normalized(Vec3{alpha * view.x, alpha * view.y, view.z});
  const Vec2 around = cos_sin_turns(u);
  const float z = (1 - v) * (1 + stretched.z) - stretched.z;
  const float r = std::sqrt(std::clamp(1 - z * z, 0.0f, 1.0f));
  const Vec3 h = Vec3{r * around.x, r * around.y, z} + stretched;
  return normalized(Vec3{alpha * h.x, alpha * h.y, std::max(h.z, 1e-7f)});
}
/// Schlick 1994: the share of 1 - f0 that is reflected on top of f0.
inline float schlick(float cosine) {
  const float m = clamp01(1 - cosine);
  const float m2 = m * m;
  return m2 * m2 * m;
}

}  // namespace polymorph
