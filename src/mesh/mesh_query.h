// Closest-point queries on a mesh with hints: a triangle known to be near makes a query faster.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "kernels/mesh.h"
#include "mesh/closest.h"
#include "mesh/fans.h"

namespace polymorph {

/// Non-owning view of a mesh and its hierarchy.
struct MeshQuery {
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;
  const ClosestPointQuery& tree;
  const Fans* fans = nullptr;  ///< the triangles around each point, for walk_to_closest()

  /// Distance from a point to one triangle.
  float distance_to(Vec3 from, std::uint32_t triangle) const;
  /// Finds the closest point as tree.closest() does. `hint` is a triangle that may be near, or
  /// kNoTriangle. It affects only the time, except where tree.closest() may return any of several
  /// nearly closest triangles.
  ClosestPoint closest(Vec3 from, std::uint32_t hint) const;
  /// Finds the point closest to `from` among those reached from triangle `start` by a walk over
  /// neighbouring triangles, each of which is nearer than the one before. Returns nothing if the
  /// walk is long. Needs `fans`.
  std::optional<ClosestPoint> walk_to_closest(Vec3 from, std::uint32_t start) const;
  /// Calls closest() for each point with its hint, in parallel, and sets the hints to the triangles
  /// found. Points beyond the end of `hints` have no hint.
  std::vector<ClosestPoint> closest(std::span<const Vec3> from,
                                    std::vector<std::uint32_t>& hints) const;
};

/// Twice the triangle's area along its normal.
inline Vec3 area_normal(std::span<const Vec3> points, const Triangle& t) {
  return cross(points[t.v[1]] - points[t.v[0]], points[t.v[2]] - points[t.v[0]]);
}

}  // namespace polymorph
