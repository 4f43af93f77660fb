// Closest-point queries on a triangle mesh (8-wide BVH).
#pragma once

#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "mesh/closest_tree.h"
#include "mesh/mesh_view.h"

namespace polymorph {

/// A hierarchy over triangles (copied: the mesh need not live on). Const calls may run on many
/// threads; answers do not depend on them. Triangles without area stand for the segment or point
/// that they are.
class ClosestPointQuery {
 public:
  explicit ClosestPointQuery(MeshView mesh);
  ClosestPointQuery(std::span<const Vec3> points, std::span<const Triangle> triangles)
      : ClosestPointQuery(MeshView(points, triangles)) {}
  /// Builds the query over a subset of the triangles (ascending indices).
  ClosestPointQuery(MeshView mesh, std::span<const std::uint32_t> faces);
  ~ClosestPointQuery();
  ClosestPointQuery(ClosestPointQuery&&) noexcept;
  ClosestPointQuery& operator=(ClosestPointQuery&&) noexcept;

  /// Finds the closest point no further than `max_distance`; of several, the one on the triangle of
  /// lowest index; where thousands of triangles are long (build_split_bvh()), one within a
  /// ten-thousandth of the closest, and where far fewer represent them (thin_long_triangles()), the
  /// closest of those. If there is none (no triangles, all further off, a NaN in
  /// `from`): point = from, distance = max_distance, triangle = kNoTriangle. A small `max_distance`
  /// is much faster where most points are far off.
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

  /// The hierarchy's arrays, for find_closest().
  TriangleBvhView view() const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// Weights of a closest point within its triangle.
TriangleWeights weights_at(MeshView mesh, const ClosestPoint& hit);

/// Interpolates values that are given per vertex.
inline Vec3 interpolate(std::span<const Vec3> values, const Triangle& t, const TriangleWeights& w) {
  return values[t.v[0]] * static_cast<float>(w.a) + values[t.v[1]] * static_cast<float>(w.b) +
         values[t.v[2]] * static_cast<float>(w.c);
}

/// Interpolates normals that are given per corner (3 per triangle); not of unit length.
Vec3 interpolate_normal(MeshView mesh, std::span<const Vec3> corner_normals,
                        const ClosestPoint& hit);

}  // namespace polymorph
