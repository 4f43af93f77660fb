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
