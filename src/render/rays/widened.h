// Widening of triangles, so that Embree finds all that a ray may hit.
#pragma once

#include <vector>

#include "render/render.h"

namespace polymorph {

/// Position of a vertex after a fraction of its displacement.
inline Vec3 displace(const RenderMesh& mesh, std::size_t vertex, float fraction) {
  return mesh.positions[vertex] + mesh.displacement[vertex] * fraction;
}

/// Computes the corners of every triangle, three each and in order, with each edge moved outward by
/// at least `margin` within the triangle's plane. A triangle so sharp that its corners would move
/// very far is replaced by another that covers it. `fractions`: for a mesh that moves, the
/// fractions of its displacement at which corners are computed, one set each; empty for a static
/// mesh.
std::vector<std::vector<Vec3>> widen_triangles(const RenderMesh& mesh, float margin,
                                               const std::vector<float>& fractions);

}  // namespace polymorph
