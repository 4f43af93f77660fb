// Path scattering at surfaces: BSDF sampling, glass, shadow catcher.
#pragma once

#include "render/materials/glass.h"
#include "render/path/path.h"
#include "render/path/shadow_rays.h"
#include "render/path/surface_shading.h"

namespace polymorph {

/// Random numbers of eight paths' vertices, in disjoint sets.
struct VertexRandom {
  static constexpr std::uint32_t kSkySets = 1024, kGlassSets = 2048,
                                 kLightSets = 8192;  ///< larger than any depth
  static constexpr std::uint32_t kMaxLights = 32;
  PathSamplerOf<Pack> sampler;
  std::uint32_t set;  ///< 1 + v at vertex v
  /// Numbers for the key light and the next direction.
  Sample4Of<Pack> own() const { return sampler.get(set); }
  Sample4Of<Pack> sky() const { return sampler.get(kSkySets + set); }
  Sample4Of<Pack> glass() const { return sampler.get(kGlassSets + set); }
  Sample4Of<Pack> light(std::size_t i) const {
    return sampler.get(kLightSets + set * kMaxLights + static_cast<std::uint32_t>(i));
  }
};

/// Vertices of eight paths, with what sampling the lights needs.
struct Vertices {
  Paths& path;
  PackBits rows;  ///< indices of the paths in the wave
  Pack3 origin;   ///< origin of the rays that leave
  PackMask live;
  PackMask shared{};  ///< lanes whose next ray may also hit suns and lamps
  ShadowRays& shadows;
  PackMask records_unlit{};  ///< lanes whose unoccluded light is recorded as well (Paths::unlit)
};

/// Scatter paths at a surface; both return the lanes whose paths continue.
PackMask scatter_on_floor(const World& world, Vertices& at, const FloorPointOf<Pack3>& point,
                          const VertexRandom& random, RayStats& stats);
PackMask scatter_on_mesh(const World& world, Vertices& at, const SurfacePointOf<Pack3>& point,
                         const BsdfOf<Pack3>& bsdf, const VertexRandom& random);

/// Refracts or reflects a path at a boundary of glass.
void pass_glass(const World& world, PathRow& path, const SurfacePoint& point, const Shading& glass,
                const Sample4& random);

}  // namespace polymorph
