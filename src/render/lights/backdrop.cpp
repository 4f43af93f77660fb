#include "render/lights/backdrop.h"

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

Pack3 backdrop_radiance(const Backdrop& backdrop, const Pack3& direction) {
  if (backdrop.sky) return sky_radiance(*backdrop.sky, direction);
  const Pack3 d = to_local(backdrop.camera, direction);
  const Pack forward = max(d.z, 1e-3f);
  const Pack x = d.x / forward * backdrop.scale, y = d.y / forward * backdrop.scale;
  // A pool of light behind the subject, a little above the middle; darker towards the corners and
  // the top.
  const Pack distance = sqrt(0.55f * x * x + square(y - 0.1f));
  return backdrop.paper * (1.10f - 0.34f * smoothstep(0, 1.9f, distance));
}

}  // namespace polymorph
