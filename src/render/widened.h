// Triangles made a little larger, so that Embree finds all that a ray may meet.
#pragma once

#include <cstdint>
#include <vector>

#include "render/render.h"

namespace polymorph {

/// Where a vertex of the mesh is at a share `way` of its displacement.
inline Vec3 moved(const RenderMesh& mesh, std::size_t vertex, float way) {
  return mesh.positions[vertex] + mesh.displacement[vertex] * way;
}

struct WidenedMesh {
  /// The corners of every triangle, three each and in order; one set for each way.
  std::vector<std::vector<Vec3>> corners;
  /// For each triangle, whether it is the triangle scaled, each edge just `by` farther out, and at
  /// most twice as large; in all sets.
  std::vector<std::uint8_t> scaled;
};

/// The triangles with each edge moved out by at least `by` within its plane. A triangle so sharp
/// that its corners would fly off is replaced by another that covers it. `ways`: for a mesh that
/// moves the shares of its displacement at which the corners are wanted; empty for one that does
/// not.
WidenedMesh widened_mesh(const RenderMesh& mesh, float by, const std::vector<float>& ways);

}  // namespace polymorph
