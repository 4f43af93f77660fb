// Rays and their intersections, for one ray or for eight.
#pragma once

#include <cstdint>
#include <limits>

#include "base/box.h"
#include "render/math/simd.h"

namespace polymorph {

/// One ray, or eight rays.
template <class T3>
struct RayOf {
  T3 origin;
  T3 direction;  ///< unit
  /// Time while the shutter is open, [0, 1].
  ComponentOf<T3> time = broadcast<ComponentOf<T3>>(0.5f);
  /// Distance at which the ray ends.
  ComponentOf<T3> far = broadcast<ComponentOf<T3>>(std::numeric_limits<float>::infinity());
};
using Ray = RayOf<Vec3>;

inline constexpr std::uint32_t kNoMesh = 0xffffffffu;

/// Intersection of a ray with a mesh; by default there is none.
template <class V>
struct MeshHitOf {
  BitsOf<V> mesh = BitsOf<V>{} + kNoMesh;  ///< index in RenderScene::meshes, or kNoMesh
  BitsOf<V> triangle{};                    ///< index in the mesh
  V distance{};                            ///< along the ray, in scene units
  V u{}, v{};                              ///< weights of the triangle's second and third corner
};
using MeshHit = MeshHitOf<float>;

/// Geometry at a hit point, as shading needs it.
template <class T3>
struct SurfacePointOf {
  T3 position;
  T3 normal;   ///< the triangle's normal, on the side of the ray's origin; unit
  T3 shading;  ///< interpolated normal, on the side of `normal` and facing the ray, or `normal` if
               ///< the mesh has none; unit
  T3 lifted;   ///< position on the smooth surface that the shading normals describe; further rays
               ///< start there
  MaskOf<T3> inside{};  ///< the ray came from behind the triangle
};
using SurfacePoint = SurfacePointOf<Vec3>;

/// Tests whether a ray misses a box.
template <class T3>
PM_HD inline MaskOf<T3> misses_box(const Box& box, const RayOf<T3>& ray) {
  using V = ComponentOf<T3>;
  // This is Box::empty(), which GPU code cannot call.
  if (!(box.low.x <= box.high.x && box.low.y <= box.high.y && box.low.z <= box.high.z))
    return broadcast_mask<MaskOf<T3>>(true);
  V near = broadcast<V>(0), far = ray.far;
  const auto clip = [&](V origin, V direction, float low, float high) {
    const V inverse = 1.0f / direction;
    const V a = (low - origin) * inverse, b = (high - origin) * inverse;
    // A ray in the plane of a side gives a NaN, for which these comparisons leave the interval
    // unchanged.
    near = max(min(a, b), near);
    far = min(max(a, b), far);
  };
  clip(ray.origin.x, ray.direction.x, box.low.x, box.high.x);
  clip(ray.origin.y, ray.direction.y, box.low.y, box.high.y);
  clip(ray.origin.z, ray.direction.z, box.low.z, box.high.z);
  return near > far;
}

}  // namespace polymorph
