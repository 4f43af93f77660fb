#include "mesh/crossings.h"

#include <algorithm>
#include <cmath>

#include "kernels/linear.h"

namespace polymorph {
namespace {

/// Coordinates of a triangle's corners relative to a point, along an axis and the two that follow
/// it cyclically.
struct ProjectedCorner {
  double along = 0, u = 0, v = 0;
};

ProjectedCorner relative_corner(Vec3 p, Vec3 origin, int axis) {
  const Vec3d d = Vec3d(p) - Vec3d(origin);
  if (axis == 0) return {d.x, d.y, d.z};
  if (axis == 1) return {d.y, d.z, d.x};
  return {d.z, d.x, d.y};
}

}  // namespace

void list_triangles(const TriangleBvhView& bvh, const Box& box,
                    std::vector<TriangleBvh::Corners>& triangles) {
  triangles.clear();
  for_each_touching_leaf(
      bvh.nodes, box, [] { return true; },
      [&](std::uint32_t first, std::uint32_t count) {
        for (std::uint32_t slot = first; slot < first + count; ++slot)
          if (bounds_touch(bvh.corners[slot], box)) triangles.push_back(bvh.corners[slot]);
      });
}

std::optional<int> count_entries(std::span<const TriangleBvh::Corners> triangles, Vec3 from,
                                 int axis, double length) {
  // Far above the rounding of sums of products of floats' differences.
  constexpr double kTolerance = 1e-10;
  int entries = 0;
  for (const TriangleBvh::Corners& corners : triangles) {
    const ProjectedCorner a = relative_corner(corners.p[0], from, axis),
                          b = relative_corner(corners.p[1], from, axis),
                          c = relative_corner(corners.p[2], from, axis);
    if (std::min({a.along, b.along, c.along}) > length ||
        std::max({a.along, b.along, c.along}) < 0 || std::min({a.u, b.u, c.u}) > 0 ||
        std::max({a.u, b.u, c.u}) < 0 || std::min({a.v, b.v, c.v}) > 0 ||
        std::max({a.v, b.v, c.v}) < 0)
      continue;
    // Twice the signed areas of the triangles that the segment's line and two corners make in the
    // projection along the axis. They have the same sign if the line goes through the triangle.
    const double at_a = b.u * c.v - b.v * c.u, at_b = c.u * a.v - c.v * a.u,
                 at_c = a.u * b.v - a.v * b.u;
    const double size = std::max(
        {std::abs(a.u), std::abs(a.v), std::abs(b.u), std::abs(b.v), std::abs(c.u), std::abs(c.v)});
    const double tolerance = kTolerance * size * size;
    const double low = std::min({at_a, at_b, at_c}), high = std::max({at_a, at_b, at_c});
    if (low < -tolerance && high > tolerance) continue;
    if (low <= tolerance && high >= -tolerance) return std::nullopt;
    const double doubled_area = at_a + at_b + at_c;
    const double at = (at_a * a.along + at_b * b.along + at_c * c.along) / doubled_area;
    const double reach =
        std::max({std::abs(a.along), std::abs(b.along), std::abs(c.along), length});
    if (std::abs(at) <= kTolerance * reach || std::abs(at - length) <= kTolerance * reach)
      return std::nullopt;
    // The normal points along the axis if the area is positive: the segment comes from the back.
    if (at > 0 && at < length) entries += doubled_area > 0 ? -1 : 1;
  }
  return entries;
}

}  // namespace polymorph
