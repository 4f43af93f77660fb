// Scene of the path tracer (meshes, floor, sky, suns and lamps), and ray intersection with meshes
// and floor.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include "render/aov.h"
#include "render/lights/backdrop.h"
#include "render/lights/lamps.h"
#include "render/lights/lights.h"
#include "render/rays/scene_build.h"

namespace polymorph {

/// The scene as the path tracer sees it. Borrowed, constant during a frame.
struct World {
  const TracedScene* geometry = nullptr;  ///< null on a GPU
  Box bounds;                             ///< TracedScene::bounds()
  float upright_radius = 0;               ///< TracedScene::upright_radius()
  float epsilon = 0;                      ///< TracedScene::epsilon()
  SkyTables sky;
  std::span<const DistantLight> suns;  ///< the key light first
  std::span<const Lamp> lamps;
  Floor floor;
  Backdrop backdrop;
  Vec3 center;       ///< centre of a sphere around all meshes
  float radius = 0;  ///< its radius; -infinity without meshes: nothing is occluded
  LookSettings look;
  /// Radiance of a white surface under all these lights: the unit of kIndirectLimit and kDiscLimit
  /// (path.h).
  float white = 1;
  /// Number of surfaces at which a path may scatter. The first mirrors do not count (kFreeMirrors).
  int max_depth = 4;
  /// If true, paths end at the first surface, lights are sampled at their centres, and the sky's
  /// occlusion is ignored on meshes and only estimated on the floor.
  bool direct_only = false;
  bool has_glass = false;    ///< whether any mesh has glass
  bool transparent = false;  ///< camera rays see no backdrop, except through glass
  bool shadow_only = false;  ///< the floor is a shadow catcher (PathLight in integrator.h)
  float time = 0;            ///< time within the sequence, shown by an AOV
};

/// Numbers of rays and paths traced.
struct RayStats {
  std::uint64_t rays = 0, paths = 0;
};

/// The closest intersection of a ray: with `mesh` if its index is not kNoMesh, else with the floor
/// if `floor` is finite, else none.
template <class V>
struct IntersectionOf {
  MeshHitOf<V> mesh;
  /// Distance to the floor, or infinity if the ray misses it; finite even if a mesh hides the
  /// floor.
  V floor = broadcast<V>(std::numeric_limits<float>::infinity());
};
using Intersection = IntersectionOf<float>;

#if defined(PM_PACKS)
inline Ray lane(const RayOf<Pack3>& ray, int l) {
  return {lane(ray.origin, l), lane(ray.direction, l), ray.time[l], ray.far[l]};
}
inline Intersection lane(const IntersectionOf<Pack>& packs, int l) {
  return {{packs.mesh.mesh[l], packs.mesh.triangle[l], packs.mesh.distance[l], packs.mesh.u[l],
           packs.mesh.v[l]},
          packs.floor[l]};
}

/// Intersects up to kPacket rays, the first `count` lanes of one or two packs. `coherent`: their
/// directions are similar.
inline void intersect_closest(const World& world, const RayOf<Pack3>* rays,
                              IntersectionOf<Pack>* intersections, int count, bool coherent,
                              RayStats& stats) {
  RayOf<Pack3> shortened[2];
  MeshHitOf<Pack> hits[2];
  const int packs = (count + kLanes - 1) / kLanes;
  for (int i = 0; i < packs; ++i) {
    shortened[i] = rays[i];
    intersections[i].floor = intersect_floor(world.floor, rays[i]);
    shortened[i].far = min(intersections[i].floor, rays[i].far);
  }
  stats.rays += static_cast<std::uint64_t>(count);
  world.geometry->closest(shortened, hits, count, coherent);
  for (int i = 0; i < packs; ++i) intersections[i].mesh = hits[i];
}
#endif

}  // namespace polymorph
