#include "render/stage.h"

#include <algorithm>
#include <cmath>

namespace polymorph {

Floor make_floor(const GroundSettings& settings, const Box& bounds) {
  Floor floor;
  const float radius = std::max(0.5f * bounds.diagonal(), 1e-6f);
  floor.enabled = settings.enabled;
  floor.center = bounds.empty() ? Vec3{} : bounds.center();
  floor.height = settings.height.value_or(bounds.empty() ? 0.0f : bounds.low.y);
  floor.center.y = floor.height;
  floor.color = settings.color;
  // Beyond four radii an object of radius 1 hides less than 2 % of the sky from the floor.
  floor.fade_start = 2.0f * radius;
  floor.fade_end = 7.0f * radius;
  return floor;
}

bool meets_floor(const Floor& floor, const Ray& ray, FloorHit& hit) {
  if (!floor.enabled || ray.direction.y >= 0 || ray.origin.y <= floor.height) return false;
  hit.distance = (floor.height - ray.origin.y) / ray.direction.y;
  if (!(hit.distance < ray.far)) return false;
  hit.position = ray.origin + ray.direction * hit.distance;
  hit.position.y = floor.height;
  const float x = hit.position.x - floor.center.x, z = hit.position.z - floor.center.z;
  const float away = std::sqrt(x * x + z * z);
  hit.fade = smoothstep(floor.fade_start, floor.fade_end, away);
  hit.tone =
      lerp(1.0f, floor.far_tone, smoothstep(0.2f * floor.fade_start, 0.8f * floor.fade_end, away));
  return hit.fade < 1;
}

Vec3 backdrop_radiance(const Backdrop& backdrop, Vec3 direction) {
  if (backdrop.sky) return sky_radiance(*backdrop.sky, direction);
  const Vec3 d = to_local(backdrop.camera, direction);
  const float forward = std::max(d.z, 1e-3f);
  const float x = d.x / forward * backdrop.scale, y = d.y / forward * backdrop.scale;
  // A pool of light behind the subject, a little above the middle; darker towards the corners and
  // the top.
  const float away = std::sqrt(0.55f * x * x + square(y - 0.1f));
  const float light = 1.10f - 0.34f * smoothstep(0, 1.9f, away);
  return backdrop.paper * light;
}

}  // namespace polymorph
