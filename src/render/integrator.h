// Path tracing with next-event estimation: light that reaches the camera along one ray.
#pragma once

#include <cstdint>

#include "render/aov.h"
#include "render/lights.h"
#include "render/sampler.h"
#include "render/scene_build.h"
#include "render/stage.h"

namespace polymorph {

/// All that a path can meet. Borrowed, constant while a frame is traced.
struct World {
  const TracedScene* geometry = nullptr;
  const Sky* sky = nullptr;
  const KeyLight* key = nullptr;
  Floor floor;
  Backdrop backdrop;
  Vec3 center;  ///< of a sphere around all meshes
  float radius = 0;
  LookSettings look;
  float white = 1;  ///< what a white surface sends back under all this light; scales the limits
  int max_depth =
      4;  ///< surfaces that a path may scatter at; mirrors count less, see integrator.cpp
};

struct Tally {
  std::uint64_t rays = 0;
};

/// Radiance along a camera ray. `sampler` gives set 1 + v at vertex v.
Vec3 trace_path(const World& world, const Ray& ray, const PathSampler& sampler, Tally& tally);

/// What the AOVs show along a camera ray; `depth` is still the distance along the ray.
FirstHit first_hit(const World& world, const Ray& ray, Tally& tally);

}  // namespace polymorph
