// Floor and backdrop: the ground plane below the objects and the background behind them.
#pragma once

#include "kernels/types.h"
#include "render/lights/lights.h"
#include "render/lights/sky.h"
#include "render/rays/ray.h"
#include "render/render.h"

namespace polymorph {

/// Brightness of the distant floor and backdrop relative to the centre of the scene. The falloff
/// keeps the sides of mirrors from reflecting a uniform grey.
inline constexpr float kFarTone = 0.74f;

/// A horizontal, diffuse floor that fades into the background, so that there is no horizon line.
struct Floor {
  bool enabled = false;
  float height = 0;      ///< y of the floor
  Vec3 color;            ///< albedo at the centre
  Vec3 center;           ///< centre of the fade
  float fade_start = 1;  ///< horizontal distances from `center` at which the fade begins and ends
  float fade_end = 2;
  /// Brightness of the distant floor relative to the centre; 1 under a sky that shows its own
  /// ground (an image or the day sky).
  float far_tone = kFarTone;
};
/// Makes the floor below objects with these bounds.
Floor make_floor(const GroundSettings& settings, const Box& bounds);

/// Returns the distance at which a ray from above hits the visible part of the floor, or infinity
/// if there is no such hit in (0, ray.far).
template <class T3>
PM_HD inline ComponentOf<T3> intersect_floor(const Floor& floor, const RayOf<T3>& ray) {
  using V = ComponentOf<T3>;
  const V no_hit = broadcast<V>(std::numeric_limits<float>::infinity());
  if (!floor.enabled) return no_hit;
  const V distance = (floor.height - ray.origin.y) / ray.direction.y;
  const V x = ray.origin.x + ray.direction.x * distance - floor.center.x;
  const V z = ray.origin.z + ray.direction.z * distance - floor.center.z;
  const MaskOf<T3> hit = (ray.direction.y < 0.0f) & (ray.origin.y > floor.height) &
                         (distance < ray.far) & (x * x + z * z < floor.fade_end * floor.fade_end);
  return select(hit, distance, no_hit);
}

/// Geometry and appearance of the floor at a hit point.
template <class T3>
struct FloorPointOf {
  T3 position;
  ComponentOf<T3> fade;  ///< 0 = fully visible, 1 = invisible
  ComponentOf<T3> tone;  ///< factor of the floor's colour
};
/// Computes the floor's point at this distance along a ray.
template <class T3>
PM_HD inline FloorPointOf<T3> floor_point(const Floor& floor, const RayOf<T3>& ray,
                                          ComponentOf<T3> distance) {
  using V = ComponentOf<T3>;
  FloorPointOf<T3> point;
  point.position = ray.origin + ray.direction * distance;
  point.position.y = broadcast<V>(floor.height);
  const V x = point.position.x - floor.center.x, z = point.position.z - floor.center.z;
  const V distance_to_center = sqrt(x * x + z * z);
  point.fade = smoothstep(floor.fade_start, floor.fade_end, distance_to_center);
  // The tone changes closer to the centre than the fade.
  const V far_weight =
      smoothstep(0.2f * floor.fade_start, 0.8f * floor.fade_end, distance_to_center);
  point.tone = 1.0f + (floor.far_tone - 1.0f) * far_weight;
  return point;
}

/// Background of camera rays that hit nothing.
struct Backdrop {
  /// True if the backdrop is the sky (an image or the day sky), false if it is the studio's paper.
  bool shows_sky = false;
  Vec3 paper;       ///< radiance of the paper in the middle of the picture
  Frame camera;     ///< x right, y up, z forward
  float scale = 1;  ///< 1 / tan(half the vertical field of view)
};
/// Computes the radiance of the backdrop in a direction.
template <class T3>
PM_HD T3 backdrop_radiance(const Backdrop& backdrop, const SkyTables& sky, const T3& direction) {
  using V = ComponentOf<T3>;
  if (backdrop.shows_sky) return sky_radiance(sky, direction);
  const T3 d = to_local(backdrop.camera, direction);
  const V forward = max(d.z, 1e-3f);
  const V x = d.x / forward * backdrop.scale, y = d.y / forward * backdrop.scale;
  // The paper is brightest a little above the middle of the picture, behind the subject, and darker
  // towards the corners. x and y are in half picture heights from the middle.
  const V distance = sqrt(0.55f * x * x + square(y - 0.1f));
  return backdrop.paper * (1.10f - 0.34f * smoothstep(0, 1.9f, distance));
}
#if defined(PM_PACKS)
extern template Pack3 backdrop_radiance(const Backdrop&, const SkyTables&, const Pack3&);
#endif

}  // namespace polymorph
