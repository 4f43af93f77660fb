// GGX microfacet distribution, isotropic, in a local frame (z = normal), for one direction or for
// eight. `alpha` is the width of the lobe, the square of a material's roughness.
#pragma once

#include "render/math/vector_math.h"

namespace polymorph {

// Smallest alpha that is used; its lobe is a mirror within the precision of float.
inline constexpr float kMinAlpha = 1e-3f;

/// Normal distribution function D (Trowbridge-Reitz).
template <class T3>
PM_HD inline ComponentOf<T3> ggx_normal_density(T3 half, ComponentOf<T3> alpha) {
  // (h.x^2 + h.y^2) / a^2 + h.z^2 stays accurate for sharp lobes; the usual h.z^2 (a^2 - 1) + 1
  // cancels.
  const ComponentOf<T3> a2 = alpha * alpha;
  const ComponentOf<T3> e = (half.x * half.x + half.y * half.y) / a2 + half.z * half.z;
  return kInvPi / (a2 * e * e);
}
/// Returns sqrt(a^2 + (1 - a^2) cosine^2), the root in Smith's masking function for GGX.
template <class V>
PM_HD inline V ggx_root(V cosine, V alpha) {
  const V a2 = alpha * alpha;
  return sqrt(a2 + (1.0f - a2) * cosine * cosine);
}
/// Smith's masking function G1: the fraction of microfacets that are visible from a direction.
template <class V>
PM_HD inline V ggx_masking(V cosine, V alpha) {
  return 2.0f * cosine / (cosine + ggx_root(cosine, alpha));
}
/// Returns G2 / (4 a b) for directions of cosines a and b, where G2 is Smith's height-correlated
/// masking and shadowing (Heitz 2014).
template <class V>
PM_HD inline V ggx_visibility(V a, V b, V alpha) {
  return 0.5f / (a * ggx_root(b, alpha) + b * ggx_root(a, alpha));
}
/// Returns the pdf, per solid angle, of the reflection of `view` at a normal that
/// sample_ggx_normal() draws. `half`: that normal.
template <class T3>
PM_HD inline ComponentOf<T3> ggx_direction_pdf(T3 view, T3 half, ComponentOf<T3> alpha) {
  return ggx_normal_density(half, alpha) / (2.0f * (view.z + ggx_root(view.z, alpha)));
}
/// Samples a microfacet normal that is visible from `view` (Dupuy and Benyoub 2023, spherical
/// caps).
template <class T3>
PM_HD inline T3 sample_ggx_normal(T3 view, ComponentOf<T3> alpha, ComponentOf<T3> u,
                                  ComponentOf<T3> v) {
  using V = ComponentOf<T3>;
  const T3 stretched = normalized(T3{alpha * view.x, alpha * view.y, view.z});
  const Vec2Of<V> azimuth = cos_sin_turns(u);
  const V z = (1.0f - v) * (1.0f + stretched.z) - stretched.z;
  const V r = sqrt(clamp01(1.0f - z * z));
  const T3 h = T3{r * azimuth.x, r * azimuth.y, z} + stretched;
  return normalized(T3{alpha * h.x, alpha * h.y, max(h.z, 1e-7f)});  // above the surface
}
/// Schlick's approximation (1994), (1 - cosine)^5: the reflectance is f0 + (1 - f0)
/// schlick(cosine).
template <class V>
PM_HD inline V schlick(V cosine) {
  const V m = clamp01(1.0f - cosine);
  const V m2 = m * m;
  return m2 * m2 * m;
}

}  // namespace polymorph
