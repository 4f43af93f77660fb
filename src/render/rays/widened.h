// Triangles made a little larger, so that Embree finds all that a ray may hit.
#pragma once

#include <vector>

#include "render/render.h"

namespace polymorph {

/// Where a vertex of the mesh is at a share `way` of its displacement.
inline Vec3 moved(const RenderMesh& mesh, std::size_t vertex, float way) {
  return mesh.positions[vertex] + mesh.displacement[vertex] * way;
}

/// The corners of every triangle, three each and in order, with each edge moved out by at least
/// `by` within the triangle's plane. A triangle so sharp that its corners would fly off is replaced
/// by another that covers it. `ways`: for a mesh that moves the shares of its displacement at which
/// the corners are wanted, one set each; empty for one that does not.
std::vector<std::vector<Vec3>> widened_corners(const RenderMesh& mesh, float by,
                                               const std::vector<float>& ways);

}  // namespace polymorph
