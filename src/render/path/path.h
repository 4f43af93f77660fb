// Path state of the path tracer, and the light that a path's ray receives from the sky, suns and
// lamps that it hits.
#pragma once

#include "render/math/sampler.h"
#include "render/path/world.h"

namespace polymorph {

// A path may pass this many sharp mirrors without paying from max_depth, so that reflections show
// lit surfaces and not the end of a path.
inline constexpr int kFreeMirrors = 2;
// And so many boundaries of glass: two balls and what is behind them, with a reflection inside.
inline constexpr std::uint32_t kFreeGlass = 8;

// Flags of a path, one bit each; above them, the number of glass boundaries that it may still pass.
inline constexpr std::uint32_t kHitsLights = 1;     ///< suns and lamps count for its ray
inline constexpr std::uint32_t kFromCamera = 2;     ///< nothing but clear glass between
inline constexpr std::uint32_t kThroughGlass = 4;   ///< there was some
inline constexpr std::uint32_t kOnShadowFloor = 8;  ///< its first vertex: only the shadows are kept
/// By a diffuse or rough surface. From then on glossy lobes are followed as diffuse ones of the
/// same colour: their caustics would be noise at any sample count that one would wait for, and
/// the light they lose is kept.
inline constexpr std::uint32_t kScattered = 16;
inline constexpr std::uint32_t kGlassShift = 8;

/// State of one path, or of eight: the same 24 numbers, as a row or as columns.
template <class T3>
struct PathOf {
  using V = ComponentOf<T3>;
  RayOf<T3> ray;
  T3 radiance{};
  T3 throughput = broadcast3<T3>({1, 1, 1});
  /// Control variate. Every diffuse vertex adds at once all the light it would get from an
  /// unobstructed calm sky (known exactly), and lets the next ray correct it: if the sky is seen
  /// after all, nothing is left to add; if not, the sky's share is taken back. So unshadowed
  /// surfaces have no noise from the sky. This is the throughput of that known share.
  T3 control_variate{};
  V pdf{};  ///< of the ray's direction, per solid angle
  V alpha = broadcast<V>(1);
  V unlit{};
  V depth_left{};                          ///< surfaces that it may still scatter at
  V mirrors = broadcast<V>(kFreeMirrors);  ///< and of sharp mirrors
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
/// kept whole, very strong indirect light is reduced.
Pack3 clamp_indirect(const World& world, const Paths& path, const Pack3& light);

/// Weights of one of two ways to find the same light (Veach 1997).
inline Pack power_heuristic(Pack own, Pack other) {
  const Pack ratio = other / own;
  return zero_unless(own > 0.0f, 1.0f / (1.0f + ratio * ratio));
}
inline Pack balance_heuristic(Pack own, Pack other) { return own / (own + other); }

// For the lanes `where`:

/// Adds the sky for the share of the ray that leaves the scene: all of it, or what a faded floor
/// lets pass; none where it hit a mesh.
void add_sky(const World& world, Paths& path, Pack share, PackMask where);
/// Adds the lamps that the ray hits before `distance`; they do not stop it.
void add_hit_lamps(const World& world, Paths& path, Pack distance, PackMask where);
/// Ends a path whose ray hits nothing more.
void leave_scene(const World& world, Paths& path, PackMask where);

}  // namespace polymorph
