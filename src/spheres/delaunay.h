// Delaunay tetrahedralization of points (Qhull).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/linear.h"

namespace polymorph {

/// A cell of the Delaunay tetrahedralization.
struct Tetrahedron {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::array<std::uint32_t, 4> points{};  ///< indices of its corners, ascending
  /// Indices of the tetrahedra across its faces, in no particular order; kNone at the hull.
  std::array<std::uint32_t, 4> neighbors{};
  Vec3d center;       ///< centre of the circumscribed sphere: a Voronoi vertex
  double radius = 0;  ///< radius of the circumscribed sphere
};

/// Computes the tetrahedra whose circumscribed spheres contain no other point. Flat ones, which
/// have no such sphere in double precision, are omitted. Deterministic. Errors (kInput): fewer than
/// five points, or all of them coplanar, with Qhull's message.
Result<std::vector<Tetrahedron>> delaunay_tetrahedra(std::span<const Vec3d> points);

}  // namespace polymorph
