// Vertex clustering of meshes made of many long triangles, for queries about their shape alone
// (Rossignac and Borrel 1993).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

/// A simplified mesh: each triangle once, without normals. Counted with `multiplicity` it has the
/// original's winding number; counted once, its shape.
struct ClusteredMesh {
  Mesh mesh;
  std::vector<int> multiplicity;  ///< per triangle, 1 or more
  bool thinned = false;           ///< most of the long triangles are left out
  double cell = 0;                ///< edge of the cells
};

/// Counts the triangles that are longer than a 64th of the box's diagonal. Above 16384 (usual
/// models have some thousands at most) every local query touches nearly all of them, and n queries
/// take n^2 steps.
std::size_t count_long_triangles(MeshView mesh);
bool has_many_long_triangles(std::size_t count);

/// Clusters the points of a mesh with that many long triangles in cells of a 2048th of the
/// diagonal, or of up to eight times that until the long ones are few enough. Triangles that lose
/// their extent are removed, as are pairs that coincide with opposite orientation; triangles that
/// coincide become one of that multiplicity. No point moves further than across its cell, so the
/// winding number of closed parts stays the same at all points further away than that. Where this
/// does not help, as with randomly strewn triangles, one in n of the long ones represents n.
/// Returns nothing for all other meshes.
std::optional<ClusteredMesh> cluster_long_triangles(MeshView mesh);

/// Indices, ascending, of triangles that represent a mesh of too many long ones in queries for the
/// closest point. Where cluster_long_triangles() leaves most of them out: every n-th long one and
/// all others. Where less than half of the mesh represents it, as with slivers that share a point:
/// one of those long triangles whose corners lie in the same cells, none where two cells are an
/// edge of another one's, and all others; each point of the mesh is then within the diagonal of a
/// cell of those. Empty for all other meshes.
std::vector<std::uint32_t> thin_long_triangles(MeshView mesh);

}  // namespace polymorph
