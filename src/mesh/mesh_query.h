// Nearest points of a mesh, found sooner where a triangle near them is known.
#pragma once

#include <span>
#include <vector>

#include "kernels/mesh.h"
#include "mesh/closest.h"

namespace polymorph {

/// A mesh and its hierarchy, owned elsewhere.
struct MeshQuery {
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;
  const ClosestPointQuery& tree;

  /// Distance from a point to one triangle.
  float distance_to(Vec3 from, std::uint32_t triangle) const;
  /// The closest point, as tree.closest(). `hint`: a triangle that may be near, or kNoTriangle; it
  /// changes only the time, except where tree.closest() may return any of several nearly closest
  /// triangles.
  ClosestPoint closest(Vec3 from, std::uint32_t hint) const;
  /// Calls closest() for each point, in parallel; `hints` become the triangles found.
  std::vector<ClosestPoint> closest(std::span<const Vec3> from,
                                    std::vector<std::uint32_t>& hints) const;
};

/// Twice the triangle's area along its normal.
inline Vec3 area_normal(std::span<const Vec3> points, const Triangle& t) {
  return cross(points[t.v[1]] - points[t.v[0]], points[t.v[2]] - points[t.v[0]]);
}

}  // namespace polymorph
