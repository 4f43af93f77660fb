// Closest-point queries on a triangle mesh (8-wide BVH).
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

struct ClosestPoint {
  static constexpr std::uint32_t kNoTriangle = 0xffffffffu;
  Vec3 point;
  float distance = std::numeric_limits<float>::infinity();
  std::uint32_t triangle = kNoTriangle;
};

/// A hierarchy over triangles (copied: the mesh need not live on). Const calls may run on many
/// threads; answers do not depend on them. Triangles without area stand for the segment or point
/// that they are.
class ClosestPointQuery {
 public:
  explicit ClosestPointQuery(MeshView mesh);
  ClosestPointQuery(std::span<const Vec3> points, std::span<const Triangle> triangles)
      : ClosestPointQuery(MeshView(points, triangles)) {}
  /// Of these triangles alone (ascending indices).
  ClosestPointQuery(MeshView mesh, std::span<const std::uint32_t> faces);
  ~ClosestPointQuery();
  ClosestPointQuery(ClosestPointQuery&&) noexcept;
  ClosestPointQuery& operator=(ClosestPointQuery&&) noexcept;

  /// The closest point no further than `beyond`; of several, the one on the triangle of lowest
  /// index; where thousands of triangles are long (build_split_bvh()), one within a ten-thousandth
  /// of the closest. If there is none (no triangles, all further off, a NaN in `from`): point =
  /// from, distance = beyond, triangle = kNoTriangle. A small `beyond` is much faster where most
  /// points are far off.
  ClosestPoint closest(Vec3 from, float beyond = std::numeric_limits<float>::infinity()) const;
  /// closest(), faster where `beside` is the closest point of `other`, a point near `from`.
  ClosestPoint closest(Vec3 from, Vec3 other, const ClosestPoint& beside,
                       float beyond = std::numeric_limits<float>::infinity()) const;
  /// closest() of each, in parallel.
  std::vector<ClosestPoint> closest(std::span<const Vec3> from,
                                    float beyond = std::numeric_limits<float>::infinity()) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// The point of triangle abc that is closest to p, as weights of a, b and c (each >= 0, sum 1).
struct TriangleWeights {
  double a = 1, b = 0, c = 0;
};
TriangleWeights closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c);

/// The mean of the corner normals (3 per triangle) around a point of the mesh, by its weights
/// there; not of unit length.
Vec3 interpolate_normal(MeshView mesh, std::span<const Vec3> corner_normals,
                        const ClosestPoint& at);

}  // namespace polymorph
