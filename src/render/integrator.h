// Path tracing with next-event estimation: light that reaches the camera along one ray.
#pragma once

#include <cstdint>
#include <span>

#include "render/aov.h"
#include "render/lamps.h"
#include "render/lights.h"
#include "render/sampler.h"
#include "render/scene_build.h"
#include "render/stage.h"

namespace polymorph {

/// All that a path can meet. Borrowed, constant while a frame is traced.
struct World {
  const TracedScene* geometry = nullptr;
  const Sky* sky = nullptr;
  std::span<const KeyLight> suns;  ///< the key light first
  std::span<const Lamp> lamps;
  Floor floor;
  Backdrop backdrop;
  Vec3 center;  ///< of a sphere around all meshes
  float radius = 0;
  LookSettings look;
  float white = 1;  ///< what a white surface sends back under all this light; scales the limits
  int max_depth =
      4;  ///< surfaces that a path may scatter at; mirrors count less, see integrator.cpp
  bool has_glass = false;    ///< on any mesh
  bool transparent = false;  ///< camera rays see no backdrop
  bool shadow_only = false;  ///< camera rays see of the floor only its shadows
  float moment = 0;          ///< for the AOVs
};

struct Tally {
  std::uint64_t rays = 0, paths = 0;
};

/// What a ray meets first: a mesh, else the floor (`floor` says where), else nothing.
struct Meeting {
  MeshHit mesh;
  FloorHit floor;
  bool on_floor = false;
};
/// For up to kPacket rays that go about the same way.
void meet(const World& world, const Ray* rays, Meeting* meetings, int count, Tally& tally);

/// What one camera ray brings.
struct PathLight {
  Vec3 radiance;
  float alpha = 1;
  /// On a floor of which only shadows are kept: the share of the ray that sees it (not in alpha),
  /// the light that it reflects there, and what it would reflect if nothing stood on it.
  float floor = 0, lit = 0, unlit = 0;
};

/// Light along a camera ray. `sampler` gives set 1 + v at vertex v.
PathLight trace_path(const World& world, const Ray& ray, const Meeting& first,
                     const PathSampler& sampler, Tally& tally);

/// What the AOVs show along a camera ray that meets `first`; `depth` is still the distance along
/// the ray. `motion` is left to who knows the camera, with `next` in its place.
FirstHit first_hit(const World& world, const Ray& ray, const Meeting& first);

}  // namespace polymorph
