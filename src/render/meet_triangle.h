// Where a ray meets a triangle of a mesh, decided in double precision from the same floats on every
// machine.
//
// Embree's own t, u, v depend on the instruction set (fma multiply-adds, approximate
// reciprocals), and so does its answer for rays that pass an edge closely. Here every operation is
// one that IEEE 754 rounds exactly, in one order: any processor and any compiler give the same
// bits.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "kernels/linear.h"

namespace polymorph {

/// On which side of a triangle's edges the line of a ray passes. `at[i]` belongs to the edge
/// opposite to corner i: D . (P x Q) for the edge PQ seen from the origin. It is exactly the
/// opposite of that of QP, rounding included, so two triangles that share an edge always agree
/// about it.
struct EdgeSides {
  Vec3d p[3];  ///< corners, seen from the ray's origin
  double at[3];
  double sum;  ///< twice the triangle's area as seen along the ray, with the sign of its facing

  EdgeSides(Vec3 origin, Vec3d direction, Vec3 a, Vec3 b, Vec3 c) {
    const Vec3d o(origin);
    p[0] = Vec3d(a) - o;
    p[1] = Vec3d(b) - o;
    p[2] = Vec3d(c) - o;
    at[0] = dot(direction, cross(p[1], p[2]));
    at[1] = dot(direction, cross(p[2], p[0]));
    at[2] = dot(direction, cross(p[0], p[1]));
    sum = at[0] + at[1] + at[2];
  }
  /// A line in an edge counts for both triangles; a triangle seen edge on is never met.
  bool inside() const {
    return ((at[0] >= 0 && at[1] >= 0 && at[2] >= 0) || (at[0] <= 0 && at[1] <= 0 && at[2] <= 0)) &&
           sum != 0;
  }
  /// Whether the line, for a direction of length 1, passes edge i so closely that floats cannot
  /// tell the side: their error grows with the edge's length in space, not with what is seen of it.
  /// `margin2`: the square of how far floats may be off.
  bool near(int i, double margin2) const {
    const Vec3d edge = p[(i + 2) % 3] - p[(i + 1) % 3];
    return at[i] * at[i] <= margin2 * dot(edge, edge);
  }
  /// The smallest of |at|.
  double closest() const {
    return std::min({std::fabs(at[0]), std::fabs(at[1]), std::fabs(at[2])});
  }
  bool near_any(double margin2) const {
    return near(0, margin2) || near(1, margin2) || near(2, margin2);
  }
};

struct TriangleMeeting {
  double distance = 0;  ///< along the direction; may be negative
  double u = 0, v = 0;  ///< weights of the second and the third corner
};
/// Of a line that passes inside.
inline TriangleMeeting meeting_of(const EdgeSides& sides, Vec3d d) {
  const double scale = 1 / sides.sum;
  // The corners' distances, weighted: never far outside of them, however flat the ray arrives.
  const double along = sides.at[0] * dot(sides.p[0], d) + sides.at[1] * dot(sides.p[1], d) +
                       sides.at[2] * dot(sides.p[2], d);
  return {along * scale / dot(d, d), sides.at[1] * scale, sides.at[2] * scale};
}

}  // namespace polymorph
