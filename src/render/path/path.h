// Path state of the path tracer, and the light that a path's ray receives from the sky, suns and
// lamps that it hits.
#pragma once

#include "render/math/sampler.h"
#include "render/path/world.h"

namespace polymorph {

// This many sharp mirrors do not count for max_depth, so that reflections show lit surfaces instead
// of the end of a path.
inline constexpr int kFreeMirrors = 2;
// The same for boundaries of glass: enough for two balls and the surface behind them, with an
// internal reflection.
inline constexpr std::uint32_t kFreeGlass = 8;

// With a single bounce (previews) surfaces that occlude the sky are assumed to reflect this
// fraction of it, which replaces all further bounces: fewer black pixels, and shadows of about the
// right depth.
inline constexpr float kGuessedBounce = 0.4f;

// Flags of a path, one bit each; above them, the number of glass boundaries that it may still pass.
inline constexpr std::uint32_t kHitsLights = 1;    ///< its ray may hit suns and lamps
inline constexpr std::uint32_t kFromCamera = 2;    ///< only clear glass since the camera
inline constexpr std::uint32_t kThroughGlass = 4;  ///< it has passed glass
inline constexpr std::uint32_t kOnShadowFloor =
    8;  ///< its first vertex, of which only the shadow is kept
/// Scattered by a diffuse or rough surface. From then on glossy lobes are treated as diffuse ones
/// of the same colour: their caustics would be noise at any practical sample count, and their
/// energy is kept.
inline constexpr std::uint32_t kScattered = 16;
inline constexpr std::uint32_t kGlassShift = 8;

/// State of one path, or of eight: the same 24 values, as a row or as columns.
template <class T3>
struct PathOf {
  using V = ComponentOf<T3>;
  RayOf<T3> ray;
  T3 radiance{};
  T3 throughput = broadcast3<T3>({1, 1, 1});
  /// Control variate. Every diffuse vertex immediately adds all the light that it would receive
  /// from an unoccluded calm sky (known exactly), and the next ray corrects this: if it sees the
  /// sky, nothing is added; if not, the sky's contribution is subtracted. So unshadowed surfaces
  /// have no noise from the sky. This is the throughput of the known contribution.
  T3 control_variate{};
  V pdf{};  ///< pdf of the ray's direction, per solid angle
  V alpha = broadcast<V>(1);
  V unlit{};
  V depth_left{};                          ///< surfaces at which it may still scatter
  V mirrors = broadcast<V>(kFreeMirrors);  ///< sharp mirrors that are still free
  BitsOf<V> flags = BitsOf<V>{} + (kFromCamera | (kFreeGlass << kGlassShift));
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

/// Weights of one of two strategies that sample the same light (Veach 1997).
template <class V>
PM_HD inline V power_heuristic(V own, V other) {
  const V ratio = other / own;
  return zero_unless(own > 0.0f, 1.0f / (1.0f + ratio * ratio));
}
template <class V>
PM_HD inline V balance_heuristic(V own, V other) {
  return own / (own + other);
}

// Firefly clamping, in units of World::white: of light from a sun or a lamp that arrives via
// another surface, and of the light source itself seen in a mirror. The limits are far above white,
// but permit smooth edges of highlights. Direct light, and the sky in a mirror, are never clamped.
inline constexpr float kIndirectLimit = 2.0f;
inline constexpr float kDiscLimit = 8.0f;

template <class T3>
PM_HD T3 clamp_light(T3 light, float limit) {
  const ComponentOf<T3> max_light = max_component(light);
  return select(max_light > limit, light * (limit / max_light), light);
}

/// Adds the light of a sun or lamp that the ray hits, where `hit`; `pdf` is that of sampling the
/// light.
template <class T3>
PM_HD void add_hit_light(const World& world, PathOf<T3>& path, Vec3 radiance, ComponentOf<T3> pdf,
                         MaskOf<T3> hit) {
  const ComponentOf<T3> weight = balance_heuristic(path.pdf, pdf);
  path.radiance = path.radiance + zero_unless(hit, clamp_light(path.throughput * radiance * weight,
                                                               kDiscLimit * world.white));
}

/// Firefly clamping of light that reaches the camera along a path: light at the first vertex is
/// unchanged, very strong indirect light is reduced.
template <class T3>
PM_HD T3 clamp_indirect(const World& world, const PathOf<T3>& path, const T3& light) {
  return select(has(path, kFromCamera), light, clamp_light(light, kIndirectLimit * world.white));
}

// The following functions apply to the lanes `where`.

/// Adds the sky for the fraction of the ray that leaves the scene: all of it, or the part that a
/// faded floor transmits; 0 if it hit a mesh.
template <class T3>
PM_HD_CALL void add_sky(const World& world, PathOf<T3>& path, ComponentOf<T3> share,
                        MaskOf<T3> where) {
  using Mask = MaskOf<T3>;
  const Mask camera = has(path, kFromCamera);
  const Mask seen_first = where & camera & (share > 0.0f);
  if (any(seen_first)) {
    const Mask open =
        seen_first & broadcast_mask<Mask>(world.transparent) & !has(path, kThroughGlass);
    path.alpha = path.alpha - zero_unless(open, share);
    const Mask shown = seen_first & !open;
    if (any(shown))
      path.radiance =
          path.radiance +
          zero_unless(shown, path.throughput *
                                 backdrop_radiance(world.backdrop, world.sky, path.ray.direction) *
                                 share);
  }
  const T3 seen = path.throughput * share;
  const T3 unknown = seen - path.control_variate;
  const Mask indirect =
      where & !camera & (broadcast_mask<Mask>(world.sky.has_bright) | !is_black(unknown));
  path.control_variate = zero_unless(!where, path.control_variate);
  if (!any(indirect)) return;
  const SkySplitOf<T3> sky = split_radiance(world.sky, sky_radiance(world.sky, path.ray.direction));
  path.radiance = path.radiance + zero_unless(indirect, unknown * sky.calm);
  if (!world.sky.has_bright) return;
  const ComponentOf<T3> weight =
      power_heuristic(path.pdf, bright_sky_pdf(world.sky, path.ray.direction));
  // A mirror shows the sky unclamped.
  const T3 light = seen * sky.bright * weight;
  const T3 clamped =
      select(has(path, kScattered), clamp_light(light, kIndirectLimit * world.white), light);
  path.radiance = path.radiance + zero_unless(indirect, clamped);
}

/// Adds the lamps that the ray hits before `distance`; they do not block it.
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

/// Ends a path whose ray hits nothing more.
template <class T3>
PM_HD void leave_scene(const World& world, PathOf<T3>& path, MaskOf<T3> where) {
  using V = ComponentOf<T3>;
  add_hit_lamps(world, path, broadcast<V>(kInfinity), where);
  add_sky(world, path, broadcast<V>(1), where);
  where = where & has(path, kHitsLights);
  if (!any(where)) return;
  for (const KeyLight& sun : world.suns)
    add_hit_light(world, path, sun.radiance, broadcast<V>(sun.pdf),
                  where & hits_key(sun, path.ray.direction));
}
#if defined(PM_PACKS)
extern template Pack3 clamp_indirect(const World&, const Paths&, const Pack3&);
extern template void add_sky(const World&, Paths&, Pack, PackMask);
extern template void add_hit_lamps(const World&, Paths&, Pack, PackMask);
extern template void leave_scene(const World&, Paths&, PackMask);
#endif

}  // namespace polymorph
