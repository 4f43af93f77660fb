#include "render/lights/backdrop.h"

#include <algorithm>
#include <cmath>

namespace polymorph {

Floor make_floor(const GroundSettings& settings, const Box& bounds) {
  Floor floor;
  const float radius = std::max(0.5f * bounds.diagonal(), 1e-6f);  // of the objects
  floor.enabled = settings.enabled;
  floor.center = bounds.empty() ? Vec3{} : bounds.center();
  floor.height = settings.height.value_or(bounds.empty() ? 0.0f : bounds.low.y);
  floor.center.y = floor.height;
  floor.color = settings.color;
  // The fade is around four radii, beyond which the objects hide less than 2 % of the sky from the
  // floor.
  floor.fade_start = 2.0f * radius;
  floor.fade_end = 7.0f * radius;
  return floor;
}

template Pack3 backdrop_radiance(const Backdrop&, const SkyTables&, const Pack3&);

}  // namespace polymorph
