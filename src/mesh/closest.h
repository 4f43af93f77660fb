// Closest-point queries on a triangle mesh (8-wide BVH).
#pragma once

#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "mesh/closest_tree.h"
#include "mesh/mesh_view.h"

namespace polymorph {

/// Closest-point query by a hierarchy over a copy of the triangles; the mesh may be destroyed
/// before it. Const member functions may be called from many threads at once. A triangle without
/// area counts as the segment or point to which it degenerates.
class ClosestPointQuery {
 public:
  explicit ClosestPointQuery(MeshView mesh);
  ClosestPointQuery(std::span<const Vec3> points, std::span<const Triangle> triangles)
      : ClosestPointQuery(MeshView(points, triangles)) {}
  /// Builds the query over a subset of the triangles (ascending indices of `mesh`, as in results).
  ClosestPointQuery(MeshView mesh, std::span<const std::uint32_t> faces);
  ~ClosestPointQuery();
  ClosestPointQuery(ClosestPointQuery&&) noexcept;
  ClosestPointQuery& operator=(ClosestPointQuery&&) noexcept;

  /// Finds the closest point no further than `max_distance`; of several equally close ones, that on
  /// the triangle of lowest index. Two cases are approximate: where thousands of triangles are long
  /// (build_split_bvh()), the distance exceeds the smallest by at most a ten-thousandth; where
  /// list_representative_triangles() (vertex_clustering.h) keeps only some of the triangles, the
  /// point is the closest on those. If no point is found (no triangles, all further away, a NaN in
  /// `from`): point = from, distance = max_distance, triangle = kNoTriangle. A small `max_distance`
  /// is much faster where most points are far from the mesh.
  ClosestPoint closest(Vec3 from,
                       float max_distance = std::numeric_limits<float>::infinity()) const;
  /// Finds the closest point, faster if `neighbour_hit` is the closest point of `neighbour`, a
  /// point near `from`.
  ClosestPoint closest(Vec3 from, Vec3 neighbour, const ClosestPoint& neighbour_hit,
                       float max_distance = std::numeric_limits<float>::infinity()) const;
  /// Calls closest() for each point, in parallel.
  std::vector<ClosestPoint> closest(
      std::span<const Vec3> from,
      float max_distance = std::numeric_limits<float>::infinity()) const;

  /// View of the hierarchy, for find_closest().
  TriangleBvhView view() const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// Barycentric weights of a closest point in its triangle, which must not be kNoTriangle.
TriangleWeights weights_at(MeshView mesh, const ClosestPoint& hit);

/// Interpolates values that are given per vertex.
inline Vec3 interpolate(std::span<const Vec3> values, const Triangle& t, const TriangleWeights& w) {
  return values[t.v[0]] * static_cast<float>(w.a) + values[t.v[1]] * static_cast<float>(w.b) +
         values[t.v[2]] * static_cast<float>(w.c);
}

/// Interpolates normals that are given per corner (3 per triangle). The result is not normalized.
Vec3 interpolate_normal(MeshView mesh, std::span<const Vec3> corner_normals,
                        const ClosestPoint& hit);

}  // namespace polymorph
