// Closest-point search in a triangle hierarchy, with the same bits on the CPU and the GPU.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "kernels/linear.h"
#include "kernels/simd_math.h"
#include "mesh/triangle_bvh.h"

namespace polymorph {

/// Result of ClosestPointQuery::closest() (mesh/closest.h).
struct ClosestPoint {
  static constexpr std::uint32_t kNoTriangle = 0xffffffffu;
  Vec3 point;
  float distance = std::numeric_limits<float>::infinity();
  std::uint32_t triangle = kNoTriangle;  ///< kNoTriangle: no point was found
};

/// Barycentric weights of a point in a triangle with corners a, b and c (each >= 0, sum 1).
struct TriangleWeights {
  double a = 1, b = 0, c = 0;
};

/// Parameter in [0, 1] of the point of an edge that is closest to p. `along`: dot product of the
/// edge vector and p - start; `length2`: squared length of the edge.
PM_HD inline double edge_parameter(double along, double length2) {
  if (!(length2 > 0)) return 0;  // the edge is a point
  const double t = along / length2;
  return t < 0 ? 0 : t > 1 ? 1 : t;
}

/// Weights of the closest point on the three edges, for triangles too thin to define a plane. `ap`,
/// `ab` and `ac` lead from corner a to the point p and to the corners b and c.
PM_HD inline TriangleWeights weights_on_edges(Vec3d ap, Vec3d ab, Vec3d ac) {
  const Vec3d bp = ap - ab, bc = ac - ab;
  const double t = edge_parameter(dot(ab, ap), dot(ab, ab)),
               u = edge_parameter(dot(ac, ap), dot(ac, ac)),
               v = edge_parameter(dot(bc, bp), dot(bc, bc));
  // Vectors from the edges' closest points to p.
  const Vec3d rt = ap - ab * t, ru = ap - ac * u, rv = bp - bc * v;
  const double dt = dot(rt, rt), du = dot(ru, ru), dv = dot(rv, rv);
  if (dt <= du && dt <= dv) return {1 - t, t, 0};
  if (du <= dv) return {1 - u, 0, u};
  return {0, 1 - v, v};
}

/// Weights of the closest point on a triangle, by the Voronoi regions of its corners, edges and
/// face (Ericson, Real-Time Collision Detection, 5.1.5, whose names d1 to d6, va, vb and vc are
/// used). Needs double precision: with floats, the result for a point far from a small triangle is
/// an arbitrary point of the triangle.
PM_HD inline TriangleWeights weights_on_triangle(Vec3d ap, Vec3d ab, Vec3d ac) {
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double bb = dot(ab, ab), bc = dot(ab, ac), cc = dot(ac, ac);
  // The squared sine of the angle at a is at most 1e-12: rounding would decide the plane.
  if (bb * cc - bc * bc <= 1e-12 * bb * cc) return weights_on_edges(ap, ab, ac);
  const double d3 = d1 - bb, d4 = d2 - bc;
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double d5 = d1 - bc, d6 = d2 - cc;
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = edge_parameter(d1, bb);
    return {1 - t, t, 0};
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = edge_parameter(d2, cc);
    return {1 - t, 0, t};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double t = edge_parameter(d4 - d3, (d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double sum = va + vb + vc;
  return {1 - vb / sum - vc / sum, vb / sum, vc / sum};
}

/// Weights of the point of triangle abc that is closest to p.
PM_HD inline TriangleWeights closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  return weights_on_triangle(Vec3d(p) - Vec3d(a), Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a));
}

/// Non-owning view of a TriangleBvh.
struct TriangleBvhView {
  std::span<const TriangleBvh::Node> nodes;
  std::span<const TriangleBvh::Corners> corners;
  std::span<const std::uint32_t> triangles;
  bool is_split = false;
};

/// Candidates of find_closest(): all triangles of a leaf, in ascending order.
struct AllOfLeaf {
  struct Queue {
    unsigned mask;
    PM_HD int take(float) {
      if (mask == 0) return -1;
      const int k = countr_zero(mask);
      mask &= mask - 1;
      return k;
    }
  };
  PM_HD Queue operator()(std::uint32_t, std::uint32_t count, float) const {
    return {(1u << count) - 1};
  }
};

/// Computes the squared distances of a point to the boxes of a node's children. Returns a mask of
/// the children that are no further than sqrt(limit).
PM_HD inline unsigned find_near_children(const TriangleBvh::Node& node, Vec3 from, float limit,
                                         float (&distance2)[TriangleBvh::kWidth]) {
#if defined(PM_PACKS)
  using L = Lanes<Pack>;
  static_assert(L::kCount == TriangleBvh::kWidth);
  const auto along = [&](int axis, float at) {
    return max(max(L::load(node.low[axis]) - at, at - L::load(node.high[axis])), Pack{});
  };
  const Pack x = along(0, from.x), y = along(1, from.y), z = along(2, from.z);
  const Pack squares = x * x + y * y + z * z;
  L::store(distance2, squares);
  return L::bits((squares <= limit) & (L::load_bits(node.child) != TriangleBvh::kNone));
#else
  unsigned mask = 0;
  for (int k = 0; k < TriangleBvh::kWidth; ++k) {
    const float x = max(max(node.low[0][k] - from.x, from.x - node.high[0][k]), 0.0f);
    const float y = max(max(node.low[1][k] - from.y, from.y - node.high[1][k]), 0.0f);
    const float z = max(max(node.low[2][k] - from.z, from.z - node.high[2][k]), 0.0f);
    distance2[k] = x * x + y * y + z * z;
    mask |= (distance2[k] <= limit && node.child[k] != TriangleBvh::kNone ? 1u : 0u) << k;
  }
  return mask;
#endif
}

/// Finds the closest point as ClosestPointQuery::closest() does. `candidates(slot, count, limit)`
/// returns those of the leaf's `count` triangles from `slot` on that may be no further than
/// sqrt(limit). Its take(limit) removes one of them and returns its index in the leaf, or returns
/// -1 if none is left that may be no further than sqrt(limit).
template <class Candidates>
PM_HD ClosestPoint find_closest(const TriangleBvhView& bvh, Vec3 from, float max_distance,
                                const Candidates& candidates) {
  struct Entry {
    float distance2;
    std::uint32_t child, count;  // as in TriangleBvh::Node
  };
  double best2 = static_cast<double>(max_distance) * static_cast<double>(max_distance);
  std::uint32_t best_slot = TriangleBvh::kNone, best_triangle = TriangleBvh::kNone;
  TriangleWeights best_weights;
  // Distances to boxes are rounded, so the slack keeps the boxes of triangles that are as close as
  // the best one. In a split hierarchy, thousands of triangles may share their closest point. Any
  // of them will do, so the slack is below 1 and skips the others.
  const double slack = bvh.is_split ? 1 - 1e-4 : 1 + 1e-6;
  Entry stack[TriangleBvh::kStackSize];
  int stack_size = 0;
  if (!bvh.nodes.empty()) stack[stack_size++] = {0, 0, 0};  // the root
  while (stack_size > 0) {
    const Entry entry = stack[--stack_size];
    const auto limit = static_cast<float>(best2 * slack);
    if (entry.distance2 > limit) continue;
    if (entry.count > 0) {  // a leaf
      auto queue = candidates(entry.child, entry.count, limit);
      for (int k; (k = queue.take(static_cast<float>(best2 * slack))) >= 0;) {
        const std::uint32_t slot = entry.child + static_cast<std::uint32_t>(k);
        const TriangleBvh::Corners& corners = bvh.corners[slot];
        const Vec3d a(corners.p[0]), ap = Vec3d(from) - a, ab = Vec3d(corners.p[1]) - a,
                                     ac = Vec3d(corners.p[2]) - a;
        const TriangleWeights w = weights_on_triangle(ap, ab, ac);
        const Vec3d r = ap - ab * w.b - ac * w.c;
        const double distance2 = dot(r, r);
        const std::uint32_t triangle = bvh.triangles[slot];
        if (!(distance2 < best2 || (distance2 == best2 && triangle < best_triangle))) continue;
        best2 = distance2;
        best_slot = slot;
        best_triangle = triangle;
        best_weights = w;
      }
      continue;
    }
    const TriangleBvh::Node& node = bvh.nodes[entry.child];
    float distance2[TriangleBvh::kWidth];
    unsigned child_mask = find_near_children(node, from, limit, distance2);
    const int first = stack_size;
    for (; child_mask != 0; child_mask &= child_mask - 1) {
      const int k = countr_zero(child_mask);
      // Keep the new entries sorted, the nearest child on top.
      int top = stack_size++;
      for (; top > first && stack[top - 1].distance2 < distance2[k]; --top)
        stack[top] = stack[top - 1];
      stack[top] = {distance2[k], node.child[k], node.count[k]};
    }
  }
  if (best_slot == TriangleBvh::kNone) return {from, max_distance, ClosestPoint::kNoTriangle};
  const TriangleBvh::Corners& corners = bvh.corners[best_slot];
  const Vec3d a(corners.p[0]), b(corners.p[1]), c(corners.p[2]);
  return {to_float(a + (b - a) * best_weights.b + (c - a) * best_weights.c),
          static_cast<float>(std::sqrt(best2)), best_triangle};
}

/// Finds the closest point to `from` as find_closest() does, but faster if `neighbour_hit` is the
/// closest point of `neighbour`, a point near `from`.
template <class Candidates>
PM_HD ClosestPoint find_closest_near(const TriangleBvhView& bvh, Vec3 from, Vec3 neighbour,
                                     const ClosestPoint& neighbour_hit, float max_distance,
                                     const Candidates& candidates) {
  // The neighbour's closest point bounds the distance. A split hierarchy cannot use the bound: it
  // may return any of several equally close points, and the bound would change which one.
  constexpr float kRounding = 1.0001f;  // exceeds the relative rounding of the bounds
  if (bvh.is_split || neighbour_hit.triangle == ClosestPoint::kNoTriangle)
    return find_closest(bvh, from, max_distance, candidates);
  ClosestPoint hit = find_closest(
      bvh, from, min(max_distance, kRounding * length(from - neighbour_hit.point)), candidates);
  // The neighbour's closest point is rounded, so next to the surface it may be closer to `from`
  // than any triangle. The bound by the triangle inequality is wider.
  const float bound = kRounding * (neighbour_hit.distance + length(from - neighbour));
  if (hit.triangle == ClosestPoint::kNoTriangle)
    hit = find_closest(bvh, from, min(max_distance, bound), candidates);
  if (hit.triangle == ClosestPoint::kNoTriangle && bound < max_distance)  // lengths underflowed
    hit = find_closest(bvh, from, max_distance, candidates);
  if (hit.triangle == ClosestPoint::kNoTriangle) hit.distance = max_distance;
  return hit;
}

}  // namespace polymorph
