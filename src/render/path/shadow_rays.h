// Shadow rays from surfaces to lights, traced sixteen at a time.
#pragma once

#include <array>

#include "render/materials/glass.h"
#include "render/path/surface_shading.h"
#include "render/path/world.h"

namespace polymorph {

/// Maximum number of glass boundaries per shadow ray. Meshes beyond them do not occlude it.
inline constexpr int kMaxShadowBoundaries = 32;

/// Computes the fraction of light that passes all meshes along a ray: 0 if any is opaque. Glass
/// does not bend the ray.
template <class Scene>
PM_HD_CALL Vec3 trace_transmittance(const World& world, const Scene& scene, const Ray& ray,
                                    RayStats& stats) {
  Vec3 transmittance{1, 1, 1};
  Ray segment = ray;
  for (int boundary = 0; boundary < kMaxShadowBoundaries; ++boundary) {
    ++stats.rays;
    const MeshHit hit = scene.closest(segment);
    if (hit.mesh == kNoMesh) return transmittance;
    const Shading shading = mixed_shading(world, scene.mesh(hit.mesh), hit);
    if (!(shading.transmission > 0)) return {};
    const SurfacePoint point = scene.surface_point(segment, hit);
    const float eta = point.inside ? shading.ior : 1 / shading.ior;
    transmittance = transmittance * glass_tint(shading) *
                    (1 - dielectric_fresnel(-dot(segment.direction, point.shading), eta));
    segment.origin = point.position - point.normal * world.epsilon;
    segment.far = ray.far - length(segment.origin - ray.origin);
    if (is_black(transmittance) || !(segment.far > 0)) break;
  }
  return transmittance;
}

#if defined(PM_PACKS)

/// Collects rays towards lights and adds the unoccluded light to `direct`, in the order of the
/// calls to add().
class ShadowRays {
 public:
  ShadowRays(const World& world, RayStats& stats, Vec3* direct)
      : world_(world), stats_(stats), direct_(direct) {}

  /// Adds the rays of the lanes `lanes`. If no mesh occludes the ray of lane l, direct[path[l]]
  /// receives the light of that lane. Rays that the floor occludes or that carry no light are
  /// omitted.
  void add(const RayOf<Pack3>& ray, const Pack3& light, PackBits path, PackMask lanes);
  /// Traces the rays that are still collected.
  void flush();

 private:
  struct Row {
    Ray ray;
    Vec3 light;          ///< added if the ray is unoccluded
    std::uint32_t path;  ///< index in direct_
    float padding[4];    ///< load_rows() and store_rows() need multiples of eight floats
  };
  /// Traces `count` of the collected rays, at most kPacket, from index `first` on.
  void trace(int first, int count);

  const World& world_;
  RayStats& stats_;
  Vec3* direct_;
  int count_ = 0;
  std::array<Row, 2 * kPacket> rows_;  ///< collected rays, the first count_ entries
};
#endif

}  // namespace polymorph
