#include "render/lights/lamps.h"

#include <cmath>

namespace polymorph {
Lamp make_lamp(const LampSettings& settings, Vec3 middle) {
  Lamp lamp;
  lamp.position = settings.position;
  const Vec3 to_target = settings.target.value_or(middle) - settings.position;
  // A lamp may be at its target: it then counts as very near, and a panel shines down.
  const float distance2 = std::max(dot(to_target, to_target), 1e-12f);
  lamp.irradiance = settings.color * settings.intensity;
  lamp.panel = settings.kind == LampKind::kPanel;
  const Vec3 forward = normalized(to_target);
  lamp.frame = make_frame(dot(forward, forward) > 0.5f ? forward : Vec3{0, -1, 0});
  // Turn the panel upright if possible, so that its width is horizontal.
  const Vec3 horizontal = cross(Vec3{0, 1, 0}, lamp.frame.z);
  if (dot(horizontal, horizontal) > 1e-6f) {
    lamp.frame.x = normalized(horizontal);
    lamp.frame.y = cross(lamp.frame.z, lamp.frame.x);
  }
  if (lamp.panel) {
    lamp.half_width = 0.5f * settings.width;
    lamp.half_height = 0.5f * settings.height;
    // This is exact for a small panel. A large one near its target gives less irradiance there.
    lamp.radiance = lamp.irradiance * (distance2 / (settings.width * settings.height));
    return lamp;
  }
  lamp.radius = settings.radius;
  lamp.intensity = lamp.irradiance * distance2;
  if (lamp.radius > 0) lamp.radiance = lamp.intensity / (kPi * lamp.radius * lamp.radius);
  return lamp;
}

template Pack intersect_lamp(const Lamp&, const RayOf<Pack3>&);
template Pack lamp_pdf(const Lamp&, const RayOf<Pack3>&, Pack);
template LampSampleOf<Pack3> sample_lamp(const Lamp&, const Pack3&, Pack, Pack);

}  // namespace polymorph
