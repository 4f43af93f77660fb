// State of a path, and the light of the sky, suns and lamps that its ray hits.
#pragma once

#include "render/math/sampler.h"
#include "render/path/world.h"

namespace polymorph {

// Number of sharp mirrors that do not count for max_depth, so that reflections show lit surfaces.
inline constexpr int kFreeMirrors = 2;
// Number of glass boundaries that a path may pass: enough for two balls and the surface behind
// them, with an internal reflection. They do not count for max_depth.
inline constexpr std::uint32_t kMaxGlassBoundaries = 8;

// With a single bounce (previews), surfaces that occlude the sky are assumed to reflect this
// fraction of its light. This replaces all further bounces: there are fewer black pixels, and
// shadows are about as dark as with them.
inline constexpr float kGuessedBounce = 0.4f;

// Flags of a path, one bit each. The bits from kGlassShift on are the number of glass boundaries
// that the path may still pass.

/// The light of suns and lamps that the ray hits is added.
inline constexpr std::uint32_t kHitsLights = 1;
/// The path has only been refracted by glass since the camera.
inline constexpr std::uint32_t kFromCamera = 2;
/// The path has hit glass.
inline constexpr std::uint32_t kThroughGlass = 4;
/// The first vertex is on a shadow catcher (PathLight in integrator.h).
inline constexpr std::uint32_t kOnShadowFloor = 8;
/// The path has been scattered by a diffuse or rough surface. From then on glossy lobes are treated
/// as diffuse ones of the same colour. This keeps their energy; their caustics would be noise at
/// any practical sample count.
inline constexpr std::uint32_t kScattered = 16;
inline constexpr std::uint32_t kGlassShift = 8;

/// State of one path (a row of 24 values), or of eight paths (24 columns of eight values).
template <class T3>
struct PathOf {
  using V = ComponentOf<T3>;
  RayOf<T3> ray;
  T3 radiance{};
  T3 throughput = broadcast3<T3>({1, 1, 1});
  /// Control variate. Every diffuse vertex immediately adds all the light that it would receive
  /// from an unoccluded calm sky (known exactly), and the next ray corrects this: if it sees the
  /// sky, nothing is added; if not, the sky's contribution is subtracted. So unshadowed surfaces
  /// have no noise from the sky. A glossy vertex that is the first one also adds what its gloss
  /// reflects of that sky, estimated from several directions without rays (estimate_gloss_sky() in
  /// scatter.h). This member is the throughput of the contribution that has been added.
  T3 control_variate{};
  V pdf{};                                      ///< pdf of the ray's direction, per solid angle
  V alpha = broadcast<V>(1);                    ///< PathLight::alpha
  V unlit{};                                    ///< PathLight::unlit
  V depth_left{};                               ///< surfaces at which the path may still scatter
  V free_mirrors = broadcast<V>(kFreeMirrors);  ///< further mirrors exempt from depth_left
  BitsOf<V> flags = BitsOf<V>{} + (kFromCamera | (kMaxGlassBoundaries << kGlassShift));
  BitsOf<V> sample{};  ///< SampleIndex::reversed
};
using PathRow = PathOf<Vec3>;
inline constexpr int kPathWidth = 24;
static_assert(sizeof(PathRow) == kPathWidth * sizeof(float));
#if defined(PM_PACKS)
using Paths = PathOf<Pack3>;
static_assert(sizeof(Paths) == kPathWidth * sizeof(Pack));
#endif

template <class T3>
PM_HD inline MaskOf<T3> has(const PathOf<T3>& path, std::uint32_t flag) {
  return (path.flags & flag) != 0u;
}
PM_HD inline void set(PathRow& path, std::uint32_t flag, bool on) {
  path.flags = (path.flags & ~flag) | (on ? flag : 0u);
}
#if defined(PM_PACKS)
inline void set(Paths& path, std::uint32_t flag, PackMask on) {
  path.flags = (path.flags & ~flag) | (reinterpret_cast<PackBits>(on) & flag);
}
#endif

/// Returns the multiple importance sampling weight of a strategy with the pdf `own`, when another
/// strategy samples the same light with the pdf `other` (Veach 1997).
template <class V>
PM_HD inline V power_heuristic(V own, V other) {
  const V ratio = other / own;
  return zero_unless(own > 0.0f, 1.0f / (1.0f + ratio * ratio));
}
/// Returns the weight by the balance heuristic (Veach 1997); `own` and `other` as above.
template <class V>
PM_HD inline V balance_heuristic(V own, V other) {
  return own / (own + other);
}

// Limits of firefly clamping, in units of World::white: kIndirectLimit for light of a sun, a lamp
// or the bright sky that arrives via another surface, kDiscLimit for the light source itself seen
// in a mirror. They are far above white, but low enough for smooth edges of highlights. Direct
// light, and the sky in a mirror, are never clamped.
inline constexpr float kIndirectLimit = 2.0f;
inline constexpr float kDiscLimit = 8.0f;

/// Scales the light so that no component exceeds the limit.
template <class T3>
PM_HD T3 clamp_light(T3 light, float limit) {
  const ComponentOf<T3> max_light = max_component(light);
  return select(max_light > limit, light * (limit / max_light), light);
}

/// Adds the light of a sun or lamp in the lanes `hit`, whose rays hit it. `pdf`: the pdf with which
/// sampling the light draws the ray's direction.
template <class T3>
PM_HD void add_hit_light(const World& world, PathOf<T3>& path, Vec3 radiance, ComponentOf<T3> pdf,
                         MaskOf<T3> hit) {
  const ComponentOf<T3> weight = balance_heuristic(path.pdf, pdf);
  path.radiance = path.radiance + zero_unless(hit, clamp_light(path.throughput * radiance * weight,
                                                               kDiscLimit * world.white));
}

/// Clamps very strong indirect light to avoid fireflies. Light at the path's first vertex is
/// unchanged.
template <class T3>
PM_HD T3 clamp_indirect(const World& world, const PathOf<T3>& path, const T3& light) {
  return select(has(path, kFromCamera), light, clamp_light(light, kIndirectLimit * world.white));
}

// The following functions change only the lanes `where`.

/// Adds the light of the sky, of which the ray sees `fraction`: 1 if the ray leaves the scene, the
/// fade of the floor (FloorPointOf) if it hits that, or 0 if it hits a mesh. Camera rays see the
/// backdrop. For other rays the calm part replaces what the control variate has added.
template <class T3>
PM_HD_CALL void add_sky(const World& world, PathOf<T3>& path, ComponentOf<T3> fraction,
                        MaskOf<T3> where) {
  using Mask = MaskOf<T3>;
  const Mask from_camera = has(path, kFromCamera);
  const Mask sees_backdrop = where & from_camera & (fraction > 0.0f);
  if (any(sees_backdrop)) {
    const Mask is_transparent =
        sees_backdrop & broadcast_mask<Mask>(world.transparent) & !has(path, kThroughGlass);
    path.alpha = path.alpha - zero_unless(is_transparent, fraction);
    const Mask is_opaque = sees_backdrop & !is_transparent;
    if (any(is_opaque))
      path.radiance =
          path.radiance + zero_unless(is_opaque, path.throughput *
                                                     backdrop_radiance(world.backdrop, world.sky,
                                                                       path.ray.direction) *
                                                     fraction);
  }
  const T3 seen = path.throughput * fraction;
  const T3 correction = seen - path.control_variate;
  const Mask indirect =
      where & !from_camera & (broadcast_mask<Mask>(world.sky.has_bright) | !is_black(correction));
  path.control_variate = zero_unless(!where, path.control_variate);
  if (!any(indirect)) return;
  const SkySplitOf<T3> sky = split_radiance(world.sky, sky_radiance(world.sky, path.ray.direction));
  path.radiance = path.radiance + zero_unless(indirect, correction * sky.calm);
  if (!world.sky.has_bright) return;
  const ComponentOf<T3> weight =
      power_heuristic(path.pdf, bright_sky_pdf(world.sky, path.ray.direction));
  // The sky in a mirror is not clamped.
  const T3 light = seen * sky.bright * weight;
  const T3 clamped =
      select(has(path, kScattered), clamp_light(light, kIndirectLimit * world.white), light);
  path.radiance = path.radiance + zero_unless(indirect, clamped);
}

/// Adds the light of the lamps that the ray hits before `distance`. Lamps do not occlude anything
/// behind them.
template <class T3>
PM_HD_CALL void add_hit_lamps(const World& world, PathOf<T3>& path, ComponentOf<T3> distance,
                              MaskOf<T3> where) {
  where = where & has(path, kHitsLights);
  if (!any(where)) return;
  RayOf<T3> ray = path.ray;
  ray.far = distance;
  for (const Lamp& lamp : world.lamps) {
    const ComponentOf<T3> hit = intersect_lamp(lamp, ray);
    add_hit_light(world, path, lamp.radiance, lamp_pdf(lamp, ray, hit), where & (hit < distance));
  }
}

/// Adds the sky, suns and lamps that a ray sees when it leaves the scene.
template <class T3>
PM_HD void leave_scene(const World& world, PathOf<T3>& path, MaskOf<T3> where) {
  using V = ComponentOf<T3>;
  add_hit_lamps(world, path, broadcast<V>(kInfinity), where);
  add_sky(world, path, broadcast<V>(1), where);
  where = where & has(path, kHitsLights);
  if (!any(where)) return;
  for (const DistantLight& sun : world.suns)
    add_hit_light(world, path, sun.radiance, broadcast<V>(sun.pdf),
                  where & hits_distant(sun, path.ray.direction));
}
#if defined(PM_PACKS)
extern template Pack3 clamp_indirect(const World&, const Paths&, const Pack3&);
extern template void add_sky(const World&, Paths&, Pack, PackMask);
extern template void add_hit_lamps(const World&, Paths&, Pack, PackMask);
extern template void leave_scene(const World&, Paths&, PackMask);
#endif

}  // namespace polymorph
