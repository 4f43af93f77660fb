// BSDF of surface materials: a diffuse base under a dielectric coat, metal, and mixtures of two
// such materials. All lobes are evaluated together, so a mixture adds no noise.
#pragma once

#include "kernels/types.h"
#include "model/model.h"
#include "render/materials/ggx.h"
#include "render/materials/ggx_albedo_table.h"
#include "render/math/vector_math.h"
#include "scene/scene.h"

namespace polymorph {

/// A GGX microfacet reflector (Walter et al. 2007) with height-correlated masking, Schlick's
/// Fresnel term, and the energy of multiple scattering restored (Turquin 2019, "Practical multiple
/// scattering compensation").
template <class T3>
struct GlossLobeOf {
  T3 f0;                   ///< reflectance at normal incidence
  ComponentOf<T3> alpha;   ///< roughness squared
  ComponentOf<T3> weight;  ///< weight in the mixture; 0 = absent
  T3 compensation;         ///< factor for the energy of multiple scattering
};

/// A Lambertian base under a coat.
template <class T3>
struct DiffuseLobeOf {
  T3 albedo;   ///< albedo of the base times the coat's transmittance towards the viewer and the
               ///< mixture's weight
  T3 coat_f0;  ///< 0 = no coat
  ComponentOf<T3> coat_alpha;
  T3 coat_normalization;  ///< 1 / (1 - mean albedo of the coat)
};

/// BSDF at one point for one view direction, or at eight points.
template <class T3>
struct BsdfOf {
  FrameOf<T3> frame;  ///< z = shading normal
  T3 view;            ///< towards the viewer, in `frame`; z > 0
  DiffuseLobeOf<T3> diffuse[2];
  GlossLobeOf<T3> gloss[2];
  int diffuse_count = 0, gloss_count = 0;
  T3 diffuse_albedo{};  ///< sum over all diffuse lobes
  /// Probabilities of sampling the diffuse lobes together, and each gloss lobe. Their sum is 1, or
  /// 0 for black.
  ComponentOf<T3> diffuse_probability{};
  ComponentOf<T3> gloss_probability[2] = {};
  MaskOf<T3> has_diffuse{}, has_gloss{};  ///< whether there is such a lobe
  /// Smallest alpha of the gloss lobes; 1 without gloss.
  ComponentOf<T3> sharpest_alpha = broadcast<ComponentOf<T3>>(1);
};
using Bsdf = BsdfOf<Vec3>;

/// Parameters of a material at a point, after texture lookup. They are those of Material.
template <class T3>
struct ShadingOf {
  T3 color;
  T3 specular;  ///< reflectance of the coat at normal incidence; 0 = no coat
  ComponentOf<T3> roughness;
  ComponentOf<T3> metallic;
  /// Fraction of the surface that is glass, tinted by `color`.
  ComponentOf<T3> transmission = broadcast<ComponentOf<T3>>(0);
  ComponentOf<T3> ior = broadcast<ComponentOf<T3>>(1.5f);
};
using Shading = ShadingOf<Vec3>;
/// Makes the shading parameters of a material (Material, or its copy on a GPU) whose texture has
/// the value `texel` at the point.
template <class M>
PM_HD Shading own_shading(const M& material, Vec3 texel) {
  return {material.color * texel, material.specular,     material.roughness,
          material.metallic,      material.transmission, material.ior};
}
/// Interpolates componentwise: (1 - t) a + t b.
template <class T3>
PM_HD ShadingOf<T3> mix(const ShadingOf<T3>& a, const ShadingOf<T3>& b, ComponentOf<T3> t) {
  return {lerp(a.color, b.color, t),
          lerp(a.specular, b.specular, t),
          lerp(a.roughness, b.roughness, t),
          lerp(a.metallic, b.metallic, t),
          lerp(a.transmission, b.transmission, t),
          lerp(a.ior, b.ior, t)};
}
/// Makes the shading parameters of RenderScene::look.
PM_HD inline Shading look_shading(const LookSettings& look) {
  if (look.kind == LookKind::kMatte)
    return {look.color, /*specular=*/{}, /*roughness=*/1, /*metallic=*/0};
  if (look.kind == LookKind::kGlass)
    return {look.color,     /*specular=*/{},    look.roughness,
            /*metallic=*/0, /*transmission=*/1, look.ior};
  return {look.color, look.color, look.roughness, /*metallic=*/1};
}
/// Makes the material diffuse in the lanes `matte`, with the same colour.
template <class T3>
PM_HD inline ShadingOf<T3> make_matte_where(MaskOf<T3> matte, ShadingOf<T3> s) {
  s.specular = zero_unless(!matte, s.specular);
  s.roughness = select(matte, broadcast<ComponentOf<T3>>(1), s.roughness);
  s.metallic = zero_unless(!matte, s.metallic);
  return s;
}

/// A BSDF evaluated for one direction.
template <class T3>
struct BsdfValueOf {
  T3 value{};             ///< bsdf times cosine
  ComponentOf<T3> pdf{};  ///< pdf of sample_bsdf(), per solid angle
};
using BsdfValue = BsdfValueOf<Vec3>;
template <class T3>
PM_HD T3 white() {
  return broadcast3<T3>({1, 1, 1});
}
template <class T3>
PM_HD T3 reciprocal(T3 a) {
  return {1.0f / a.x, 1.0f / a.y, 1.0f / a.z};
}

/// Albedo of a gloss lobe including multiple scattering, and the factor by which multiple
/// scattering exceeds single scattering.
template <class T3>
struct GlossEnergy {
  T3 albedo, compensation;
};
template <class T3>
PM_HD GlossEnergy<T3> compute_gloss_energy(T3 f0, ComponentOf<T3> alpha, ComponentOf<T3> cosine) {
  using V = ComponentOf<T3>;
  const SplitAlbedoOf<V> split = split_albedo(alpha, cosine);
  const V total = max(split.scale + split.bias, 1e-3f);
  const T3 compensation = white<T3>() + f0 * max((1.0f - total) / total, 0.0f);
  return {(f0 * split.scale + white<T3>() * split.bias) * compensation, compensation};
}

template <class T3>
PM_HD T3 fresnel(T3 f0, ComponentOf<T3> cosine) {
  return f0 + (white<T3>() - f0) * schlick(cosine);
}

/// Adds one material's lobes. A lobe that any of eight lanes needs is added to all lanes, with
/// weight 0 in the others.
template <class T3>
PM_HD void add_material(BsdfOf<T3>& bsdf, const ShadingOf<T3>& material, ComponentOf<T3> weight) {
  using V = ComponentOf<T3>;
  const V metal = clamp01(material.metallic);
  const T3 f0 = min(lerp(material.specular, material.color, metal), white<T3>());
  const T3 base = min(material.color, white<T3>()) * (1.0f - metal);
  const V alpha = max(square(clamp01(material.roughness)), kMinAlpha);
  const MaskOf<T3> is_present = weight > 0.0f;
  const MaskOf<T3> glossy = (!is_black(f0)) & is_present;
  const MaskOf<T3> diffuse = (!is_black(base)) & is_present;
  DiffuseLobeOf<T3> lobe{/*albedo=*/{}, /*coat_f0=*/{}, broadcast<V>(1), white<T3>()};
  T3 transmittance = white<T3>();
  if (any(glossy)) {
    const GlossEnergy<T3> energy = compute_gloss_energy(f0, alpha, bsdf.view.z);
    bsdf.gloss[bsdf.gloss_count] = {f0, alpha, zero_unless(glossy, weight), energy.compensation};
    bsdf.gloss_probability[bsdf.gloss_count++] =
        zero_unless(glossy, weight * luminance(energy.albedo));
    bsdf.has_gloss = bsdf.has_gloss | glossy;
    bsdf.sharpest_alpha = select(glossy, min(alpha, bsdf.sharpest_alpha), bsdf.sharpest_alpha);
    if (!any(diffuse)) return;
    transmittance = select(glossy, max(white<T3>() - energy.albedo, T3{}), transmittance);
    const SplitAlbedoOf<V> mean = mean_split_albedo(alpha);
    const T3 mean_coat_albedo = f0 * mean.scale + white<T3>() * mean.bias;
    lobe.coat_f0 = zero_unless(glossy, f0);
    lobe.coat_alpha = alpha;
    // The limit of 0.99 keeps the normalization finite.
    lobe.coat_normalization = reciprocal(white<T3>() - min(mean_coat_albedo, white<T3>() * 0.99f));
  }
  if (!any(diffuse)) return;
  lobe.albedo = zero_unless(diffuse, base * transmittance * weight);
  bsdf.diffuse_albedo = bsdf.diffuse_albedo + lobe.albedo;
  bsdf.has_diffuse = bsdf.has_diffuse | diffuse;
  bsdf.diffuse[bsdf.diffuse_count++] = lobe;
}

/// Makes the BSDF of the mixture (1 - t) a + t b at a point with this shading normal. `view` is a
/// unit vector in world space on the normal's side.
template <class T3>
PM_HD BsdfOf<T3> make_bsdf(const ShadingOf<T3>& a, const ShadingOf<T3>& b, ComponentOf<T3> t,
                           const T3& normal, const T3& view) {
  using V = ComponentOf<T3>;
  BsdfOf<T3> bsdf;
  bsdf.frame = make_frame(normal);
  bsdf.view = to_local(bsdf.frame, view);
  bsdf.view.z = max(bsdf.view.z, 1e-4f);
  if (any(t < 1.0f)) add_material(bsdf, a, 1.0f - t);
  if (any(t > 0.0f)) add_material(bsdf, b, t);
  const V diffuse = luminance(bsdf.diffuse_albedo);
  const V sum = diffuse + bsdf.gloss_probability[0] + bsdf.gloss_probability[1];
  const V scale = zero_unless(sum > 0.0f, 1.0f / sum);
  bsdf.diffuse_probability = diffuse * scale;
  for (V& probability : bsdf.gloss_probability) probability = probability * scale;
  return bsdf;
}

/// Evaluates the BSDF for a direction in its frame; 0 below the horizon.
template <class T3>
PM_HD_CALL BsdfValueOf<T3> evaluate_bsdf(const BsdfOf<T3>& bsdf, const T3& direction) {
  using V = ComponentOf<T3>;
  BsdfValueOf<T3> result;
  const MaskOf<T3> above = direction.z > 0.0f;
  // Diffuse lobes are dimmed by the coat's transmittance from `direction`, normalized (Kelemen and
  // Szirmay-Kalos 2001). The transmittance towards the viewer is part of `albedo`.
  for (int i = 0; i < bsdf.diffuse_count; ++i) {
    const DiffuseLobeOf<T3>& lobe = bsdf.diffuse[i];
    T3 transmittance = white<T3>();
    const MaskOf<T3> coated = !is_black(lobe.coat_f0);
    if (any(coated)) {
      const T3 coat = compute_gloss_energy(lobe.coat_f0, lobe.coat_alpha, direction.z).albedo;
      transmittance =
          select(coated, max(white<T3>() - coat, T3{}) * lobe.coat_normalization, transmittance);
    }
    result.value = result.value + lobe.albedo * transmittance * (kInvPi * direction.z);
  }
  result.pdf = bsdf.diffuse_probability * kInvPi * direction.z;
  if (bsdf.gloss_count > 0) {
    const T3 half = normalized(direction + bsdf.view);
    const V facing = dot(half, direction);
    for (int i = 0; i < bsdf.gloss_count; ++i) {
      const GlossLobeOf<T3>& lobe = bsdf.gloss[i];
      const V strength = lobe.weight * direction.z * ggx_normal_density(half, lobe.alpha) *
                         ggx_visibility(bsdf.view.z, direction.z, lobe.alpha);
      result.value = result.value + fresnel(lobe.f0, facing) * lobe.compensation * strength;
      result.pdf =
          result.pdf + bsdf.gloss_probability[i] * ggx_direction_pdf(bsdf.view, half, lobe.alpha);
    }
  }
  return {zero_unless(above, result.value), zero_unless(above, result.pdf)};
}

/// Samples a direction in the BSDF's frame. A direction below the horizon scatters no light.
template <class T3>
PM_HD T3 sample_bsdf(const BsdfOf<T3>& bsdf, ComponentOf<T3> u, ComponentOf<T3> v) {
  using V = ComponentOf<T3>;
  const MaskOf<T3> diffuse = u < bsdf.diffuse_probability;
  T3 direction = broadcast3<T3>({0, 0, -1});
  if (bsdf.diffuse_count > 0)
    direction =
        select(diffuse, cosine_direction(zero_unless(diffuse, u / bsdf.diffuse_probability), v),
               direction);
  if (bsdf.gloss_count == 0) return direction;
  // Choose a gloss lobe, and map u to [0, 1) within its interval.
  u = u - bsdf.diffuse_probability;
  V probability = bsdf.gloss_probability[0], alpha = bsdf.gloss[0].alpha;
  if (bsdf.gloss_count == 2) {
    const MaskOf<T3> second = u >= probability;
    u = select(second, u - probability, u);
    probability = select(second, bsdf.gloss_probability[1], probability);
    alpha = select(second, bsdf.gloss[1].alpha, alpha);
  }
  const MaskOf<T3> glossy = (!diffuse) & (probability > 0.0f);
  const T3 half =
      sample_ggx_normal(bsdf.view, alpha, zero_unless(glossy, min(u / probability, 0.9999999f)), v);
  return select(glossy, half * (2.0f * dot(bsdf.view, half)) - bsdf.view, direction);
}
#if defined(PM_PACKS)
extern template BsdfOf<Pack3> make_bsdf(const ShadingOf<Pack3>&, const ShadingOf<Pack3>&, Pack,
                                        const Pack3&, const Pack3&);
extern template BsdfValueOf<Pack3> evaluate_bsdf(const BsdfOf<Pack3>&, const Pack3&);
extern template Pack3 sample_bsdf(const BsdfOf<Pack3>&, Pack, Pack);
#endif

}  // namespace polymorph
