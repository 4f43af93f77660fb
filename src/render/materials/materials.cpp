#include "render/materials/materials.h"

#include "render/materials/ggx.h"
#include "render/materials/ggx_albedo_table.h"

namespace polymorph {
namespace {

template <class T3>
T3 white() {
  return broadcast3<T3>({1, 1, 1});
}
template <class T3>
T3 reciprocal(T3 a) {
  return {1.0f / a.x, 1.0f / a.y, 1.0f / a.z};
}

/// Single-scattering albedo, and the factor that restores the energy of multiple scattering.
template <class T3>
struct GlossEnergy {
  T3 albedo, compensation;
};
template <class T3>
GlossEnergy<T3> compute_gloss_energy(T3 f0, ComponentOf<T3> alpha, ComponentOf<T3> cosine) {
  using V = ComponentOf<T3>;
  const SplitAlbedoOf<V> split = split_albedo(alpha, cosine);
  const V total = max(split.scale + split.bias, 1e-3f);
  const T3 compensation = white<T3>() + f0 * max((1.0f - total) / total, 0.0f);
  return {(f0 * split.scale + white<T3>() * split.bias) * compensation, compensation};
}

template <class T3>
T3 fresnel(T3 f0, ComponentOf<T3> cosine) {
  return f0 + (white<T3>() - f0) * schlick(cosine);
}

/// Adds one material's lobes. A lobe that exists in one of eight lanes is added to all, with weight
/// 0 elsewhere.
template <class T3>
void add_material(BsdfOf<T3>& bsdf, const ShadingOf<T3>& material, ComponentOf<T3> weight) {
  using V = ComponentOf<T3>;
  const V metal = clamp01(material.metallic);
  const T3 f0 = min(lerp(material.specular, material.color, metal), white<T3>());
  const T3 base = min(material.color, white<T3>()) * (1.0f - metal);
  const V alpha = max(square(clamp01(material.roughness)), kMinAlpha);
  const MaskOf<T3> is_present = weight > 0.0f;
  const MaskOf<T3> glossy = (!is_black(f0)) & is_present;
  const MaskOf<T3> diffuse = (!is_black(base)) & is_present;
  DiffuseLobeOf<T3> lobe{{}, {}, broadcast<V>(1), white<T3>()};
  T3 remaining = white<T3>();
  if (any(glossy)) {
    const GlossEnergy<T3> energy = compute_gloss_energy(f0, alpha, bsdf.view.z);
    bsdf.gloss[bsdf.gloss_count] = {f0, alpha, zero_unless(glossy, weight), energy.compensation};
    bsdf.choose_gloss[bsdf.gloss_count++] = zero_unless(glossy, weight * luminance(energy.albedo));
    bsdf.has_gloss = bsdf.has_gloss | glossy;
    bsdf.sharpest_alpha = select(glossy, min(alpha, bsdf.sharpest_alpha), bsdf.sharpest_alpha);
    if (!any(diffuse)) return;
    remaining = select(glossy, max(white<T3>() - energy.albedo, T3{}), remaining);
    const SplitAlbedoOf<V> mean = mean_split_albedo(alpha);
    const T3 coat = f0 * mean.scale + white<T3>() * mean.bias;
    lobe.coat_f0 = zero_unless(glossy, f0);
    lobe.coat_alpha = alpha;
    lobe.coat_normalization = reciprocal(white<T3>() - min(coat, white<T3>() * 0.99f));
  }
  if (!any(diffuse)) return;
  lobe.albedo = zero_unless(diffuse, base * remaining * weight);
  bsdf.diffuse_albedo = bsdf.diffuse_albedo + lobe.albedo;
  bsdf.has_diffuse = bsdf.has_diffuse | diffuse;
  bsdf.diffuse[bsdf.diffuse_count++] = lobe;
}

template <class T3>
BsdfOf<T3> make_mixture(const ShadingOf<T3>& a, const ShadingOf<T3>& b, ComponentOf<T3> share,
                        T3 normal, T3 view) {
  using V = ComponentOf<T3>;
  BsdfOf<T3> bsdf;
  bsdf.frame = make_frame(normal);
  bsdf.view = to_local(bsdf.frame, view);
  bsdf.view.z = max(bsdf.view.z, 1e-4f);
  if (any(share < 1.0f)) add_material(bsdf, a, 1.0f - share);
  if (any(share > 0.0f)) add_material(bsdf, b, share);
  const V diffuse = luminance(bsdf.diffuse_albedo);
  const V sum = diffuse + bsdf.choose_gloss[0] + bsdf.choose_gloss[1];
  const V scale = zero_unless(sum > 0.0f, 1.0f / sum);
  bsdf.choose_diffuse = diffuse * scale;
  for (V& choose : bsdf.choose_gloss) choose = choose * scale;
  return bsdf;
}

template <class T3>
BsdfValueOf<T3> evaluate(const BsdfOf<T3>& bsdf, T3 direction) {
  using V = ComponentOf<T3>;
  BsdfValueOf<T3> result;
  const MaskOf<T3> above = direction.z > 0.0f;
  // Kelemen and Szirmay-Kalos 2001: transmittance of the coat on entry and on exit, normalized.
  for (int i = 0; i < bsdf.diffuse_count; ++i) {
    const DiffuseLobeOf<T3>& lobe = bsdf.diffuse[i];
    T3 remaining = white<T3>();
    const MaskOf<T3> coated = !is_black(lobe.coat_f0);
    if (any(coated)) {
      const T3 coat = compute_gloss_energy(lobe.coat_f0, lobe.coat_alpha, direction.z).albedo;
      remaining =
          select(coated, max(white<T3>() - coat, T3{}) * lobe.coat_normalization, remaining);
    }
    result.value = result.value + lobe.albedo * remaining * (kInvPi * direction.z);
  }
  result.pdf = bsdf.choose_diffuse * kInvPi * direction.z;
  if (bsdf.gloss_count > 0) {
    const T3 half = normalized(direction + bsdf.view);
    const V facing = dot(half, direction);
    for (int i = 0; i < bsdf.gloss_count; ++i) {
      const GlossLobeOf<T3>& lobe = bsdf.gloss[i];
      const V strength = lobe.weight * direction.z * ggx_normal_density(half, lobe.alpha) *
                         ggx_visibility(bsdf.view.z, direction.z, lobe.alpha);
      result.value = result.value + fresnel(lobe.f0, facing) * lobe.compensation * strength;
      result.pdf =
          result.pdf + bsdf.choose_gloss[i] * ggx_direction_pdf(bsdf.view, half, lobe.alpha);
    }
  }
  return {zero_unless(above, result.value), zero_unless(above, result.pdf)};
}

template <class T3>
T3 sample(const BsdfOf<T3>& bsdf, ComponentOf<T3> u, ComponentOf<T3> v) {
  using V = ComponentOf<T3>;
  const MaskOf<T3> diffuse = u < bsdf.choose_diffuse;
  T3 direction = broadcast3<T3>({0, 0, -1});
  if (bsdf.diffuse_count > 0)
    direction = select(diffuse, cosine_direction(zero_unless(diffuse, u / bsdf.choose_diffuse), v),
                       direction);
  if (bsdf.gloss_count == 0) return direction;
  u = u - bsdf.choose_diffuse;
  V edge = bsdf.choose_gloss[0], alpha = bsdf.gloss[0].alpha;
  if (bsdf.gloss_count == 2) {
    const MaskOf<T3> second = u >= edge;
    u = select(second, u - edge, u);
    edge = select(second, bsdf.choose_gloss[1], edge);
    alpha = select(second, bsdf.gloss[1].alpha, alpha);
  }
  const MaskOf<T3> glossy = (!diffuse) & (edge > 0.0f);
  const T3 half =
      sample_ggx_normal(bsdf.view, alpha, zero_unless(glossy, min(u / edge, 0.9999999f)), v);
  return select(glossy, half * (2.0f * dot(bsdf.view, half)) - bsdf.view, direction);
}

}  // namespace

Shading own_shading(const Material& material, Vec3 texel) {
  return {material.color * texel, material.specular,     material.roughness,
          material.metallic,      material.transmission, material.ior};
}

Shading mix(const Shading& a, const Shading& b, float share) {
  return {lerp(a.color, b.color, share),
          lerp(a.specular, b.specular, share),
          lerp(a.roughness, b.roughness, share),
          lerp(a.metallic, b.metallic, share),
          lerp(a.transmission, b.transmission, share),
          lerp(a.ior, b.ior, share)};
}

Shading look_shading(const LookSettings& look) {
  if (look.kind == LookKind::kMatte) return {look.color, {}, 1, 0};
  if (look.kind == LookKind::kGlass) return {look.color, {}, look.roughness, 0, 1, look.ior};
  return {look.color, look.color, look.roughness, 1};
}

Bsdf make_bsdf(const Shading& a, const Shading& b, float share, Vec3 normal, Vec3 view) {
  return make_mixture(a, b, share, normal, view);
}
BsdfOf<Pack3> make_bsdf(const ShadingOf<Pack3>& a, const ShadingOf<Pack3>& b, Pack share,
                        const Pack3& normal, const Pack3& view) {
  return make_mixture(a, b, share, normal, view);
}

BsdfValue evaluate_bsdf(const Bsdf& bsdf, Vec3 direction) { return evaluate(bsdf, direction); }
BsdfValueOf<Pack3> evaluate_bsdf(const BsdfOf<Pack3>& bsdf, const Pack3& direction) {
  return evaluate(bsdf, direction);
}

Vec3 sample_bsdf(const Bsdf& bsdf, float u, float v) { return sample(bsdf, u, v); }
Pack3 sample_bsdf(const BsdfOf<Pack3>& bsdf, Pack u, Pack v) { return sample(bsdf, u, v); }

}  // namespace polymorph
