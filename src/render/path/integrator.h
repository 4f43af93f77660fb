// Path tracing with next-event estimation, for many camera rays at once (wavefront).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "render/math/sampler.h"
#include "render/path/path.h"

namespace polymorph {

/// The light along one camera ray.
struct PathLight {
  Vec3 radiance;
  float alpha = 1;
  /// For a shadow catcher, a floor of which only the shadows are kept: the fraction of the ray that
  /// sees the floor (not part of alpha), the luminance that the floor reflects, and the luminance
  /// that it would reflect without shadows.
  float floor = 0, lit = 0, unlit = 0;
};

/// Computes the light of a path that has ended. `direct`: the light that its shadow rays brought.
PM_HD inline PathLight make_result(const PathRow& path, Vec3 direct) {
  const Vec3 radiance = path.radiance + direct;
  const PathLight light{radiance, std::max(path.alpha, 0.0f), /*floor=*/0, /*lit=*/0, /*unlit=*/0};
  if (!has(path, kOnShadowFloor)) return light;
  // Here alpha is the fraction of the ray that sees the faded floor. write_colors() computes how
  // much of it is shadow.
  return {/*radiance=*/{}, /*alpha=*/0, light.alpha, luminance(radiance), path.unlit};
}

/// An intersection as a row of floats; load_rows() reads multiples of eight.
struct IntersectionRow {
  Intersection intersection;
  float padding[2];
};
static_assert(sizeof(IntersectionRow) == 8 * sizeof(float));

/// The values of a FirstHit on a mesh that are looked up to shade the hit, too.
struct ShadedHit {
  Vec3 position, normal, albedo;  ///< those of FirstHit
};

/// Camera rays whose paths are traced together, and their light.
struct Wavefront {
  static constexpr int kMax = 512;  ///< maximum number of rays
  int count = 0;
  std::array<Ray, kMax> rays;                       ///< `far` is ignored
  std::array<std::uint32_t, kMax> samples;          ///< SampleIndex::reversed of each ray
  std::uint32_t sequence = 0;                       ///< SampleIndex::sequence of all rays
  bool is_intersected = false;                      ///< whether `intersections` are known
  std::array<IntersectionRow, kMax> intersections;  ///< closest ones of the rays
  std::array<PathLight, kMax> path_lights;          ///< filled by trace()
  /// The rays' hits on meshes; filled by trace() if `is_intersected`.
  std::array<ShadedHit, kMax> shaded_hits;
};

/// Traces the light along the wavefront's rays. Vertex v of a path draws the sampler's set 1 + v.
/// The light along a ray does not depend on the other rays.
void trace(const World& world, const FrameSampler& sampler, Wavefront& wave, RayStats& stats);

/// Selects the values of FirstHit that need a lookup of materials. At hits on meshes, values that
/// are not selected stay 0.
struct CostlyValues {
  bool albedo, uv;
};

#if defined(PM_PACKS)
/// Computes the AOVs of eight camera rays, whose first intersections are `first`. The caller must
/// complete FirstHit::depth and FirstHit::motion, which depend on the camera: `depth` is the
/// distance along the ray here, and `motion` is not set. `hits`: default values, which stay where a
/// ray hits nothing. `shaded`: eight hits that trace() has found, which are not looked up again;
/// null if there are none.
void find_first_hits(const World& world, const RayOf<Pack3>& rays,
                     const IntersectionOf<Pack>& first, CostlyValues values,
                     const ShadedHit* shaded, FirstHit (&hits)[kLanes]);
#endif

/// Returns the label of the triangle's corner with the largest barycentric weight at a hit (the
/// first of equal ones). The mesh must have labels.
std::uint32_t nearest_label(const RenderMesh& mesh, const MeshHit& hit);

}  // namespace polymorph
