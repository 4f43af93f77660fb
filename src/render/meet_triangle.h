// Where a ray meets a triangle, decided in double precision from the same floats on every machine.
//
// Embree's own t, u, v depend on the instruction set (fused multiply-adds, approximate
// reciprocals), and so does its answer for rays that pass an edge closely. Here every operation is
// one that IEEE 754 rounds exactly, in one order: any processor and any compiler give the same
// bits.
#pragma once

#include "kernels/linear.h"

namespace polymorph {

struct TriangleMeeting {
  double distance = 0;  ///< along the direction; may be negative
  double u = 0, v = 0;  ///< weights of the second and the third corner
};

/// Whether the line of the ray passes the triangle, and where. Both sides count; a triangle seen
/// edge on is never met.
///
/// The sign of D . (P x Q) says on which side of the edge PQ the line passes. It is exactly the
/// opposite of that of QP, rounding included, so two triangles that share an edge always agree
/// about it, and no line slips through between them; one that meets the edge itself meets both.
inline bool meet_triangle(Vec3 origin, Vec3 direction, Vec3 a, Vec3 b, Vec3 c,
                          TriangleMeeting& out) {
  const Vec3d o(origin), d(direction);
  const Vec3d p = Vec3d(a) - o, q = Vec3d(b) - o, r = Vec3d(c) - o;
  const double at_a = dot(d, cross(q, r));
  const double at_b = dot(d, cross(r, p));
  const double at_c = dot(d, cross(p, q));
  const bool inside =
      (at_a >= 0 && at_b >= 0 && at_c >= 0) || (at_a <= 0 && at_b <= 0 && at_c <= 0);
  const double sum = at_a + at_b + at_c;
  if (!inside || sum == 0) return false;
  const double scale = 1 / sum;
  out.u = at_b * scale;
  out.v = at_c * scale;
  // The corners' distances, weighted: never far outside of them, however flat the ray arrives.
  out.distance = (at_a * dot(p, d) + at_b * dot(q, d) + at_c * dot(r, d)) * scale / dot(d, d);
  return true;
}

}  // namespace polymorph
