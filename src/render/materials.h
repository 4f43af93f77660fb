// How surfaces scatter light: a diffuse base under a dielectric coat, metal, and mixtures of two
// such materials. All lobes are evaluated together, so a mixture costs no noise.
#pragma once

#include "kernels/types.h"
#include "model/model.h"
#include "render/vector_math.h"
#include "scene/scene.h"

namespace polymorph {

/// A GGX microfacet reflector (Walter et al. 2007) with height-correlated masking, Schlick's
/// Fresnel term, and the energy of multiple scattering restored (Turquin 2019, "Practical multiple
/// scattering compensation").
struct GlossLobe {
  Vec3 f0;             ///< reflectance head on
  float alpha = 0.1f;  ///< roughness squared
  float weight = 1;
  Vec3 compensation{1, 1, 1};
};

/// A Lambertian base under a coat.
struct DiffuseLobe {
  Vec3 albedo;   ///< left under the coat as seen from the viewer, times the mixture's weight
  Vec3 coat_f0;  ///< 0 = no coat
  float coat_alpha = 1;
  Vec3 coat_rest{1, 1, 1};  ///< 1 / (1 - mean albedo of the coat)
};

/// Scattering at one point, seen from one direction.
struct Bsdf {
  Frame frame;  ///< z = shading normal
  Vec3 view;    ///< towards the viewer, in `frame`; z > 0
  DiffuseLobe diffuse[2];
  GlossLobe gloss[2];
  int diffuse_count = 0, gloss_count = 0;
  Vec3 diffuse_albedo;       ///< of all diffuse lobes together
  float choose_diffuse = 0;  ///< probabilities of sampling each kind; sum 1, or all 0 for black
  float choose_gloss[2] = {0, 0};
};

/// A uniform, texture-resolved material.
struct Shading {
  Vec3 color;
  Vec3 specular;
  float roughness;
  float metallic;
  float transmission = 0;  ///< share that is clear glass of this colour
  float ior = 1.5f;
};
Shading own_shading(const Material& material, Vec3 texel);
/// (1 - share) a + share b, number by number.
Shading mix(const Shading& a, const Shading& b, float share);
Shading look_shading(const LookSettings& look);
/// The same colour without gloss.
inline Shading matte_shading(const Shading& s) {
  return {s.color, {}, 1, 0, s.transmission, s.ior};
}

/// A mixture (1 - share) a + share b at a point with this shading normal; `view` is a unit world
/// vector on the normal's side.
Bsdf make_bsdf(const Shading& a, const Shading& b, float share, Vec3 normal, Vec3 view);

struct BsdfValue {
  Vec3 value;         ///< bsdf times cosine
  float density = 0;  ///< of sample_bsdf, per solid angle
};
/// `direction` in the bsdf's frame; zero below the horizon.
BsdfValue evaluate_bsdf(const Bsdf& bsdf, Vec3 direction);

/// A direction in the bsdf's frame (it may lie below the horizon: then nothing is scattered there).
Vec3 sample_bsdf(const Bsdf& bsdf, float u, float v);

/// The sharpest lobe's alpha; 1 without gloss.
float sharpest_alpha(const Bsdf& bsdf);

/// Directional albedo of a GGX lobe, F0 = `f0`, at cosine `cosine`; with multiple scattering.
Vec3 gloss_albedo(Vec3 f0, float alpha, float cosine);

}  // namespace polymorph
