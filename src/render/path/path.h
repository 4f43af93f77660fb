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
using Paths = PathOf<Pack3>;
inline constexpr int kPathWidth = 24;
static_assert(sizeof(PathRow) == kPathWidth * sizeof(float));
static_assert(sizeof(Paths) == kPathWidth * sizeof(Pack));

inline PackMask has(const Paths& path, std::uint32_t flag) { return (path.flags & flag) != 0u; }
inline bool has(const PathRow& path, std::uint32_t flag) { return (path.flags & flag) != 0; }
inline void set(Paths& path, std::uint32_t flag, PackMask on) {
  path.flags = (path.flags & ~flag) | (reinterpret_cast<PackBits>(on) & flag);
}

/// Firefly clamping of light that reaches the camera along a path: light at the first vertex is
/// unchanged, very strong indirect light is reduced.
Pack3 clamp_indirect(const World& world, const Paths& path, const Pack3& light);

/// Weights of one of two strategies that sample the same light (Veach 1997).
inline Pack power_heuristic(Pack own, Pack other) {
  const Pack ratio = other / own;
  return zero_unless(own > 0.0f, 1.0f / (1.0f + ratio * ratio));
}
inline Pack balance_heuristic(Pack own, Pack other) { return own / (own + other); }

// The following functions apply to the lanes `where`.

/// Adds the sky for the fraction of the ray that leaves the scene: all of it, or the part that a
/// faded floor transmits; 0 if it hit a mesh.
void add_sky(const World& world, Paths& path, Pack share, PackMask where);
/// Adds the lamps that the ray hits before `distance`; they do not block it.
void add_hit_lamps(const World& world, Paths& path, Pack distance, PackMask where);
/// Ends a path whose ray hits nothing more.
void leave_scene(const World& world, Paths& path, PackMask where);

}  // namespace polymorph
