#include "mesh/mesh_query.h"

#include "base/parallel.h"

namespace polymorph {

float MeshQuery::distance_to(Vec3 from, std::uint32_t triangle) const {
  const Triangle& t = triangles[triangle];
  const Vec3 a = points[t.v[0]], b = points[t.v[1]], c = points[t.v[2]];
  const TriangleWeights w = closest_on_triangle(from, a, b, c);
  // All terms are differences between points. They are small, so single precision suffices.
  return length((a - from) + (b - a) * static_cast<float>(w.b) + (c - a) * static_cast<float>(w.c));
}

ClosestPoint MeshQuery::closest(Vec3 from, std::uint32_t hint) const {
  if (hint >= triangles.size()) return tree.closest(from);
  // The margin exceeds the rounding of a distance, so that the hinted triangle itself is found.
  const float bound = distance_to(from, hint) * 1.0001f + 1e-6f * length(from);
  const ClosestPoint hit = tree.closest(from, bound);
  return hit.triangle == ClosestPoint::kNoTriangle ? tree.closest(from) : hit;
}

std::optional<ClosestPoint> MeshQuery::walk_to_closest(Vec3 from, std::uint32_t start) const {
  constexpr int kMaxSteps = 12;
  const auto weights_in = [&](std::uint32_t f) {
    const Triangle& t = triangles[f];
    return closest_on_triangle(from, points[t.v[0]], points[t.v[1]], points[t.v[2]]);
  };
  const auto point_in = [&](std::uint32_t f, const TriangleWeights& w) {
    const Triangle& t = triangles[f];
    const Vec3 a = points[t.v[0]];
    return a + (points[t.v[1]] - a) * static_cast<float>(w.b) +
           (points[t.v[2]] - a) * static_cast<float>(w.c);
  };
  TriangleWeights w = weights_in(start);
  ClosestPoint best{point_in(start, w), 0, start};
  best.distance = length(best.point - from);
  for (int step = 0; step < kMaxSteps; ++step) {
    if (w.a > 0 && w.b > 0 && w.c > 0) return best;
    // The closest point lies on a side or at a corner. Its nearest corner, that of the largest
    // weight, has the triangles where a nearer point may be.
    const std::uint32_t f = best.triangle;
    const int corner = w.a >= w.b && w.a >= w.c ? 0 : w.b >= w.c ? 1 : 2;
    for (const std::uint32_t g : fans->around(triangles[f].v[corner])) {
      if (g == f) continue;
      const TriangleWeights v = weights_in(g);
      const Vec3 point = point_in(g, v);
      const float distance = length(point - from);
      if (distance < best.distance) best = {point, distance, g}, w = v;
    }
    if (best.triangle == f) return best;
  }
  return std::nullopt;
}

std::vector<ClosestPoint> MeshQuery::closest(std::span<const Vec3> from,
                                             std::vector<std::uint32_t>& hints) const {
  hints.resize(from.size(), ClosestPoint::kNoTriangle);
  std::vector<ClosestPoint> hits(from.size());
  parallel_for(
      static_cast<std::int64_t>(from.size()),
      [&](std::int64_t i) {
        hits[i] = closest(from[i], hints[i]);
        hints[i] = hits[i].triangle;
      },
      /*grain=*/256);
  return hits;
}

}  // namespace polymorph
