// Slope of the winding number: a bound of the gradient of a mesh's generalized winding number, by
// the law of Biot and Savart.
#pragma once

#include <cstddef>
#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

/// Edges of a mesh that its triangles do not traverse equally often in both directions, as at the
/// rim of a hole. The winding number jumps by whole numbers across triangles; apart from that it
/// changes only because of these edges. A closed mesh has none.
struct OpenEdges {
  std::size_t count = 0;
  /// Coordinates of the edges' middles and half their lengths, padded to whole packs.
  std::vector<float> x, y, z, half_length;
  /// Per edge: its length over 4 pi, times the difference of the traversals.
  std::vector<float> weight;
};

/// Finds the open edges of a mesh whose points are welded by position.
OpenEdges find_open_edges(MeshView mesh);

/// Bounds the length of the gradient of the winding number, jumps left out, at all points within
/// `radius` of `center`: the sum over the open edges of length / (4 pi distance^2). Infinite if an
/// open edge may come so near.
float max_winding_slope(const OpenEdges& edges, Vec3 center, float radius);

}  // namespace polymorph
