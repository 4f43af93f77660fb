// Widened triangles, with which Embree finds every triangle that a ray may hit.
#pragma once

#include <vector>

#include "render/render.h"

namespace polymorph {

/// Position of a vertex after a fraction of its displacement.
inline Vec3 displace(const RenderMesh& mesh, std::size_t vertex, float fraction) {
  return mesh.positions[vertex] + mesh.displacement[vertex] * fraction;
}

/// Moves every edge of every triangle outward by at least `margin` within the triangle's plane, and
/// returns the corners, three per triangle. A sliver, whose corners would move very far, is
/// replaced by a triangle that covers it. `fractions`: the fractions of a moving mesh's
/// displacement; the result has one set of corners per fraction. For a static mesh `fractions` is
/// empty, and the result has one set.
std::vector<std::vector<Vec3>> widen_triangles(const RenderMesh& mesh, float margin,
                                               const std::vector<float>& fractions);

}  // namespace polymorph
