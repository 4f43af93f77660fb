// What stands around the objects: the floor and the backdrop behind it.
#pragma once

#include "kernels/types.h"
#include "render/lights.h"
#include "render/render.h"
#include "render/scene_build.h"
#include "render/sky.h"

namespace polymorph {

/// The floor's (and the paper's) brightness far away, as a share of that in the middle of the
/// stage: a pool of light, so that sides of mirrors do not show one flat grey.
inline constexpr float kFarTone = 0.74f;

/// A horizontal, diffuse floor that fades into what lies behind it, so that there is no horizon
/// line.
struct Floor {
  bool enabled = false;
  float height = 0;
  Vec3 color;
  Vec3 center;           ///< around which it fades
  float fade_start = 1;  ///< horizontal distances from there
  float fade_end = 2;
  float far_tone = kFarTone;  ///< 1 under an image sky, which knows its own ground
};
Floor make_floor(const GroundSettings& settings, const Box& bounds);

/// Distance to the floor from above, or infinity; `fade` is 1 where it can no longer be seen.
struct FloorHit {
  float distance;
  Vec3 position;
  float fade;
  float tone;  ///< times the floor's colour
};
/// Is the floor met before ray.far, and not wholly faded?
bool meets_floor(const Floor& floor, const Ray& ray, FloorHit& hit);

/// What a camera ray sees where it meets nothing.
struct Backdrop {
  const Sky* sky = nullptr;  ///< an image sky is its own backdrop; null = the studio's paper
  Vec3 paper;                ///< its colour in the middle of the picture
  Frame camera;              ///< x right, y up, z forward
  float scale = 1;           ///< 1 / tan(half the vertical field of view)
};
Vec3 backdrop_radiance(const Backdrop& backdrop, Vec3 direction);

}  // namespace polymorph
