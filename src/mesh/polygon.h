// Polygon triangulation by ear clipping.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// Triangulation of one polygon.
struct PolygonTriangles {
  /// Corner indices, oriented like the polygon.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  bool planar = true;  ///< the corners deviate from a plane by at most 10 % of the polygon's size
  bool simple = true;  ///< the outline does not cross itself; else the triangles are a best effort
};

/// Triangulates a polygon of n >= 3 corners, which may be concave, into n - 2 triangles by ear
/// clipping (Meisters 1975) in the plane of Newell's normal. A convex quad is split from its first
/// corner. Takes n log n steps; their number is bounded even for outlines that cross themselves
/// everywhere.
PolygonTriangles triangulate(std::span<const Vec3> corners);

}  // namespace polymorph
