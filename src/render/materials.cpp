#include "render/materials.h"

#include "render/ggx.h"
#include "render/gloss_table.h"

namespace polymorph {
namespace {

const Vec3 kWhite{1, 1, 1};

bool is_black(Vec3 c) { return !(c.x > 0 || c.y > 0 || c.z > 0); }

/// Single-scattering albedo and the factor that restores what was scattered more than once.
struct GlossEnergy {
  Vec3 albedo, compensation;
};
GlossEnergy gloss_energy(Vec3 f0, float alpha, float cosine) {
  const SplitAlbedo split = split_albedo(alpha, cosine);
  const float whole = std::max(split.scale + split.bias, 1e-3f);
  const Vec3 compensation = kWhite + f0 * std::max(0.0f, (1 - whole) / whole);
  return {(f0 * split.scale + kWhite * split.bias) * compensation, compensation};
}

Vec3 fresnel(Vec3 f0, float cosine) { return f0 + (kWhite - f0) * schlick(cosine); }

/// Adds one material's lobes.
void add_material(Bsdf& bsdf, const Shading& material, float weight) {
  const float metal = clamp01(material.metallic);
  const Vec3 f0 = min(lerp(material.specular, material.color, metal), kWhite);
  const Vec3 base = min(material.color, kWhite) * (1 - metal);
  const float alpha = std::max(square(clamp01(material.roughness)), kLeastAlpha);
  DiffuseLobe lobe;
  Vec3 left = kWhite;
  if (!is_black(f0)) {
    const GlossEnergy energy = gloss_energy(f0, alpha, bsdf.view.z);
    bsdf.gloss[bsdf.gloss_count] = {f0, alpha, weight, energy.compensation};
    bsdf.choose_gloss[bsdf.gloss_count++] = weight * luminance(energy.albedo);
    left = max(kWhite - energy.albedo, Vec3{});
    const SplitAlbedo mean = mean_split_albedo(alpha);
    const Vec3 rest = kWhite - min(f0 * mean.scale + kWhite * mean.bias, kWhite * 0.99f);
    lobe.coat_f0 = f0;
    lobe.coat_alpha = alpha;
    lobe.coat_rest = {1 / rest.x, 1 / rest.y, 1 / rest.z};
  }
  if (is_black(base)) return;
  lobe.albedo = base * left * weight;
  bsdf.diffuse_albedo = bsdf.diffuse_albedo + lobe.albedo;
  bsdf.diffuse[bsdf.diffuse_count++] = lobe;
}

}  // namespace

Vec3 gloss_albedo(Vec3 f0, float alpha, float cosine) {
  return gloss_energy(f0, alpha, cosine).albedo;
}

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
  Bsdf bsdf;
  bsdf.frame = make_frame(normal);
  bsdf.view = to_local(bsdf.frame, view);
  bsdf.view.z = std::max(bsdf.view.z, 1e-4f);
  if (share < 1) add_material(bsdf, a, 1 - share);
  if (share > 0) add_material(bsdf, b, share);
  const float diffuse = luminance(bsdf.diffuse_albedo);
  const float sum = diffuse + bsdf.choose_gloss[0] + bsdf.choose_gloss[1];
  const float scale = sum > 0 ? 1 / sum : 0.0f;
  bsdf.choose_diffuse = diffuse * scale;
  for (float& choose : bsdf.choose_gloss) choose *= scale;
  return bsdf;
}

BsdfValue evaluate_bsdf(const Bsdf& bsdf, Vec3 direction) {
  BsdfValue result;
  if (direction.z <= 0) return result;
  // Kelemen and Szirmay-Kalos 2001: what the coat leaves, going in and coming out, normalised.
  for (int i = 0; i < bsdf.diffuse_count; ++i) {
    const DiffuseLobe& lobe = bsdf.diffuse[i];
    Vec3 left = kWhite;
    if (!is_black(lobe.coat_f0))
      left = max(kWhite - gloss_energy(lobe.coat_f0, lobe.coat_alpha, direction.z).albedo, Vec3{}) *
             lobe.coat_rest;
    result.value = result.value + lobe.albedo * left * (kInvPi * direction.z);
  }
  result.density = bsdf.choose_diffuse * kInvPi * direction.z;
  if (bsdf.gloss_count == 0) return result;
  const Vec3 half = normalized(direction + bsdf.view);
  const float facing = dot(half, direction);
  for (int i = 0; i < bsdf.gloss_count; ++i) {
    const GlossLobe& lobe = bsdf.gloss[i];
    const float strength = lobe.weight * direction.z * ggx_density(half, lobe.alpha) *
                           ggx_visibility(bsdf.view.z, direction.z, lobe.alpha);
    result.value = result.value + fresnel(lobe.f0, facing) * lobe.compensation * strength;
    result.density += bsdf.choose_gloss[i] * ggx_direction_density(bsdf.view, half, lobe.alpha);
  }
  return result;
}

Vec3 sample_bsdf(const Bsdf& bsdf, float u, float v) {
  float edge = bsdf.choose_diffuse;
  if (u < edge) return cosine_direction(u / edge, v);
  u -= edge;
  int lobe = 0;
  if (bsdf.gloss_count == 2 && u >= bsdf.choose_gloss[0]) {
    u -= bsdf.choose_gloss[0];
    lobe = 1;
  }
  edge = bsdf.choose_gloss[lobe];
  if (!(edge > 0)) return {0, 0, -1};
  const Vec3 half =
      sample_ggx_normal(bsdf.view, bsdf.gloss[lobe].alpha, std::min(u / edge, 0.9999999f), v);
  return half * (2 * dot(bsdf.view, half)) - bsdf.view;
}

float sharpest_alpha(const Bsdf& bsdf) {
  float alpha = 1;
  for (int i = 0; i < bsdf.gloss_count; ++i) alpha = std::min(alpha, bsdf.gloss[i].alpha);
  return alpha;
}

}  // namespace polymorph
