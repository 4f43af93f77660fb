// Ray-triangle intersection, decided in double precision from the same floats on every machine.
//
// Embree's own t, u, v depend on the instruction set (fused multiply-adds, approximate
// reciprocals), and so does its answer for rays that pass close to an edge. Here every operation is
// correctly rounded by IEEE 754, and their order is fixed, so every processor and compiler gives
// the same bits.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "kernels/linear.h"

namespace polymorph {

/// One value per corner of a triangle, or per edge opposite to that corner; the fourth is unused.
/// Each operation acts on the three doubles componentwise.
#if defined(__CUDACC__)
struct PerCorner {
  double v[4];
  PM_HD double operator[](int i) const { return v[i]; }
};
struct PerCornerMask {
  bool v[4];
  PM_HD bool operator[](int i) const { return v[i]; }
};
PM_HD inline PerCorner operator+(PerCorner a, PerCorner b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2], 0};
}
PM_HD inline PerCorner operator-(PerCorner a, PerCorner b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2], 0};
}
PM_HD inline PerCorner operator-(PerCorner a, double b) {
  return {a[0] - b, a[1] - b, a[2] - b, 0};
}
PM_HD inline PerCorner operator*(PerCorner a, PerCorner b) {
  return {a[0] * b[0], a[1] * b[1], a[2] * b[2], 0};
}
PM_HD inline PerCorner operator*(double a, PerCorner b) {
  return {a * b[0], a * b[1], a * b[2], 0};
}
PM_HD inline PerCorner operator*(PerCorner a, double b) { return b * a; }
PM_HD inline PerCornerMask operator<=(PerCorner a, PerCorner b) {
  return {a[0] <= b[0], a[1] <= b[1], a[2] <= b[2], false};
}
PM_HD inline PerCorner next(PerCorner a) { return {a[1], a[2], a[0], 0}; }
PM_HD inline PerCorner after_next(PerCorner a) { return {a[2], a[0], a[1], 0}; }
#else
typedef double PerCorner __attribute__((vector_size(32)));
typedef std::int64_t PerCornerMask __attribute__((vector_size(32)));

/// Rotates the values by one corner, and by two.
inline PerCorner next(PerCorner a) { return __builtin_shufflevector(a, a, 1, 2, 0, 3); }
inline PerCorner after_next(PerCorner a) { return __builtin_shufflevector(a, a, 2, 0, 1, 3); }
#endif

/// Edge functions of a triangle for a ray's line: their signs tell on which side of each edge the
/// line passes. `at[i]` belongs to the edge PQ opposite to corner i: D . (P x Q), with the ray's
/// direction D and P, Q relative to its origin. The edge QP gives exactly the negative, rounding
/// included, so two triangles that share an edge always agree.
struct EdgeFunctions {
  PerCorner x, y, z;  ///< corners, seen from the ray's origin
  PerCorner at;
  double sum;  ///< twice the triangle's area as seen along the ray, with the sign of its facing

  PM_HD EdgeFunctions(Vec3 origin, Vec3d direction, Vec3 a, Vec3 b, Vec3 c) {
    const Vec3d o(origin), p(a), q(b), r(c);
    x = PerCorner{p.x, q.x, r.x, o.x} - o.x;
    y = PerCorner{p.y, q.y, r.y, o.y} - o.y;
    z = PerCorner{p.z, q.z, r.z, o.z} - o.z;
    const PerCorner x1 = next(x), y1 = next(y), z1 = next(z);
    const PerCorner x2 = after_next(x), y2 = after_next(y), z2 = after_next(z);
    at = direction.x * (y1 * z2 - z1 * y2) + direction.y * (z1 * x2 - x1 * z2) +
         direction.z * (x1 * y2 - y1 * x2);
    sum = at[0] + at[1] + at[2];
  }
  /// Tests whether the line passes through the triangle. A line through a shared edge counts for
  /// both triangles; a triangle seen edge-on is never hit.
  PM_HD bool inside() const {
    return (std::min(std::min(at[0], at[1]), at[2]) >= 0 ||
            std::max(std::max(at[0], at[1]), at[2]) <= 0) &&
           sum != 0;
  }
  /// Tests whether the line passes edge i so closely that Embree's floats cannot decide the side.
  /// The error of an edge function is at most a position's error times the edge's length in space
  /// (not in projection). `margin2`: the square of the maximum error of a position, scene units
  /// squared. The direction must have length 1.
  PM_HD bool near(int i, double margin2) const { return near_edges(margin2)[i] != 0; }
  PM_HD bool near_any(double margin2) const {
    const PerCornerMask near = near_edges(margin2);
    return (near[0] | near[1] | near[2]) != 0;
  }
  /// Returns the smallest of |at|.
  PM_HD double closest() const {
    return std::min(std::min(std::fabs(at[0]), std::fabs(at[1])), std::fabs(at[2]));
  }

 private:
  PM_HD PerCornerMask near_edges(double margin2) const {
    const PerCorner ex = after_next(x) - next(x), ey = after_next(y) - next(y),
                    ez = after_next(z) - next(z);
    return at * at <= margin2 * (ex * ex + ey * ey + ez * ez);
  }
};

struct TriangleIntersection {
  double distance = 0;  ///< along the direction; may be negative
  double u = 0, v = 0;  ///< weights of the second and the third corner
};
/// Computes the intersection of a line with direction d. The line must pass through the triangle
/// (EdgeFunctions::inside()).
PM_HD inline TriangleIntersection compute_intersection(const EdgeFunctions& edges, Vec3d d) {
  const double scale = 1 / edges.sum;
  // The distance is a weighted mean of the corners' distances, so it stays near their range even
  // for grazing rays.
  const PerCorner along = edges.at * (edges.x * d.x + edges.y * d.y + edges.z * d.z);
  return {(along[0] + along[1] + along[2]) * scale / dot(d, d), edges.at[1] * scale,
          edges.at[2] * scale};
}

}  // namespace polymorph
