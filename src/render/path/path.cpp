#include "render/path/path.h"

namespace polymorph {
namespace {

// Firefly clamping, in units of World::white: of light from a sun or a lamp that arrives via
// another surface, and of the light source itself seen in a mirror. The limits are far above white,
// but permit smooth edges of highlights. Direct light, and the sky in a mirror, are never clamped.
constexpr float kIndirectLimit = 2.0f;
constexpr float kDiscLimit = 8.0f;

template <class T3>
T3 clamp_light(T3 light, float limit) {
  const ComponentOf<T3> max_light = max_component(light);
  return select(max_light > limit, light * (limit / max_light), light);
}

/// Adds the light of a sun or lamp that the ray hits, where `hit`; `pdf` is that of sampling the
/// light.
void add_hit_light(const World& world, Paths& path, Vec3 radiance, Pack pdf, PackMask hit) {
  const Pack weight = balance_heuristic(path.pdf, pdf);
  path.radiance = path.radiance + zero_unless(hit, clamp_light(path.throughput * radiance * weight,
                                                               kDiscLimit * world.white));
}

}  // namespace

Pack3 clamp_indirect(const World& world, const Paths& path, const Pack3& light) {
  return select(has(path, kFromCamera), light, clamp_light(light, kIndirectLimit * world.white));
}

void add_sky(const World& world, Paths& path, Pack share, PackMask where) {
  const PackMask camera = has(path, kFromCamera);
  const PackMask seen_first = where & camera & (share > 0.0f);
  if (any(seen_first)) {
    const PackMask open =
        seen_first & broadcast_mask<PackMask>(world.transparent) & !has(path, kThroughGlass);
    path.alpha = path.alpha - zero_unless(open, share);
    const PackMask shown = seen_first & !open;
    if (any(shown))
      path.radiance =
          path.radiance +
          zero_unless(shown, path.throughput *
                                 backdrop_radiance(world.backdrop, path.ray.direction) * share);
  }
  const Pack3 seen = path.throughput * share;
  const Pack3 unknown = seen - path.control_variate;
  const PackMask indirect =
      where & !camera & (broadcast_mask<PackMask>(world.sky->has_bright) | !is_black(unknown));
  path.control_variate = zero_unless(!where, path.control_variate);
  if (!any(indirect)) return;
  const SkySplitOf<Pack3> sky =
      split_radiance(*world.sky, sky_radiance(*world.sky, path.ray.direction));
  path.radiance = path.radiance + zero_unless(indirect, unknown * sky.calm);
  if (!world.sky->has_bright) return;
  const Pack weight = power_heuristic(path.pdf, bright_sky_pdf(*world.sky, path.ray.direction));
  // A mirror shows the sky unclamped.
  const Pack3 light = seen * sky.bright * weight;
  const Pack3 clamped =
      select(has(path, kScattered), clamp_light(light, kIndirectLimit * world.white), light);
  path.radiance = path.radiance + zero_unless(indirect, clamped);
}

void add_hit_lamps(const World& world, Paths& path, Pack distance, PackMask where) {
  where = where & has(path, kHitsLights);
  if (!any(where)) return;
  RayOf<Pack3> ray = path.ray;
  ray.far = distance;
  for (const Lamp& lamp : world.lamps) {
    const Pack hit = intersect_lamp(lamp, ray);
    add_hit_light(world, path, lamp.radiance, lamp_pdf(lamp, ray, hit), where & (hit < distance));
  }
}

void leave_scene(const World& world, Paths& path, PackMask where) {
  add_hit_lamps(world, path, broadcast<Pack>(kInfinity), where);
  add_sky(world, path, broadcast<Pack>(1), where);
  where = where & has(path, kHitsLights);
  if (!any(where)) return;
  for (const KeyLight& sun : world.suns)
    add_hit_light(world, path, sun.radiance, broadcast<Pack>(sun.pdf),
                  where & hits_key(sun, path.ray.direction));
}

}  // namespace polymorph
