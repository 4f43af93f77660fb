// BSDF of surface materials: a diffuse base under a dielectric coat, metal, and mixtures of two
// such materials. All lobes are evaluated together, so a mixture costs no noise.
#pragma once

#include "kernels/types.h"
#include "model/model.h"
#include "render/math/vector_math.h"
#include "scene/scene.h"

namespace polymorph {

/// A GGX microfacet reflector (Walter et al. 2007) with height-correlated masking, Schlick's
/// Fresnel term, and the energy of multiple scattering restored (Turquin 2019, "Practical multiple
/// scattering compensation").
template <class T3>
struct GlossLobeOf {
  T3 f0;                   ///< reflectance head on
  ComponentOf<T3> alpha;   ///< roughness squared
  ComponentOf<T3> weight;  ///< 0 = absent
  T3 compensation;
};

/// A Lambertian base under a coat.
template <class T3>
struct DiffuseLobeOf {
  T3 albedo;   ///< albedo under the coat as seen from the viewer, times the mixture's weight
  T3 coat_f0;  ///< 0 = no coat
  ComponentOf<T3> coat_alpha;
  T3 coat_normalization;  ///< 1 / (1 - mean albedo of the coat)
};

/// Scattering at one point, seen from one direction; or at eight.
template <class T3>
struct BsdfOf {
  FrameOf<T3> frame;  ///< z = shading normal
  T3 view;            ///< towards the viewer, in `frame`; z > 0
  DiffuseLobeOf<T3> diffuse[2];
  GlossLobeOf<T3> gloss[2];
  int diffuse_count = 0, gloss_count = 0;
  T3 diffuse_albedo{};  ///< sum over all diffuse lobes
  ComponentOf<T3>
      choose_diffuse{};  ///< probabilities of sampling each kind; sum 1, or all 0 for black
  ComponentOf<T3> choose_gloss[2] = {};
  MaskOf<T3> has_diffuse{}, has_gloss{};
  ComponentOf<T3> sharpest_alpha =
      broadcast<ComponentOf<T3>>(1);  ///< minimum of the gloss lobes; 1 without gloss
};
using Bsdf = BsdfOf<Vec3>;

/// A uniform, texture-resolved material.
template <class T3>
struct ShadingOf {
  T3 color;
  T3 specular;
  ComponentOf<T3> roughness;
  ComponentOf<T3> metallic;
  ComponentOf<T3> transmission =
      broadcast<ComponentOf<T3>>(0);  ///< fraction that is clear glass of this colour
  ComponentOf<T3> ior = broadcast<ComponentOf<T3>>(1.5f);
};
using Shading = ShadingOf<Vec3>;
Shading own_shading(const Material& material, Vec3 texel);
/// Interpolates componentwise: (1 - share) a + share b.
Shading mix(const Shading& a, const Shading& b, float share);
Shading look_shading(const LookSettings& look);
/// Removes gloss where `matte`, with the same colour.
template <class T3>
inline ShadingOf<T3> make_matte_where(MaskOf<T3> matte, ShadingOf<T3> s) {
  s.specular = zero_unless(!matte, s.specular);
  s.roughness = select(matte, broadcast<ComponentOf<T3>>(1), s.roughness);
  s.metallic = zero_unless(!matte, s.metallic);
  return s;
}

/// Makes the BSDF of a mixture (1 - share) a + share b at a point with this shading normal; `view`
/// is a unit world vector on the normal's side.
Bsdf make_bsdf(const Shading& a, const Shading& b, float share, Vec3 normal, Vec3 view);
BsdfOf<Pack3> make_bsdf(const ShadingOf<Pack3>& a, const ShadingOf<Pack3>& b, Pack share,
                        const Pack3& normal, const Pack3& view);

template <class T3>
struct BsdfValueOf {
  T3 value{};             ///< bsdf times cosine
  ComponentOf<T3> pdf{};  ///< pdf of sample_bsdf, per solid angle
};
using BsdfValue = BsdfValueOf<Vec3>;
/// Evaluates the BSDF; `direction` is in its frame; 0 below the horizon.
BsdfValue evaluate_bsdf(const Bsdf& bsdf, Vec3 direction);
BsdfValueOf<Pack3> evaluate_bsdf(const BsdfOf<Pack3>& bsdf, const Pack3& direction);

/// Samples a direction in the BSDF's frame. It may be below the horizon, where nothing is
/// scattered.
Vec3 sample_bsdf(const Bsdf& bsdf, float u, float v);
Pack3 sample_bsdf(const BsdfOf<Pack3>& bsdf, Pack u, Pack v);

}  // namespace polymorph
