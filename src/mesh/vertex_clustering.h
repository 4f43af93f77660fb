// Vertex clustering of meshes made of many long triangles, for queries about their shape alone
// (Rossignac and Borrel 1993).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

/// A simplified mesh without normals that contains each triangle once. Its triangles have the
/// original's winding number if each counts `multiplicity` times, and its shape if each counts
/// once.
struct ClusteredMesh {
  Mesh mesh;
  std::vector<int> multiplicity;  ///< per triangle, 1 or more
  bool thinned = false;           ///< most of the long triangles are left out
  double cell = 0;                ///< edge length of the cells
};

/// Counts the triangles that are longer than a 64th of the box's diagonal.
std::size_t count_long_triangles(MeshView mesh);
/// Tests for more than 16384 (usual models have some thousands at most). Every local query then
/// touches nearly all of them, and n queries take n^2 steps.
bool has_many_long_triangles(std::size_t count);

/// Clusters the points of a mesh with many long triangles in cubic cells. Their edge is a 2048th of
/// the diagonal; it is doubled, at most three times, until few long triangles remain. Triangles
/// that collapse are removed, as are pairs that coincide with opposite orientation; others that
/// coincide become one of that multiplicity. No point moves further than across its cell, so the
/// winding number of closed components stays the same at all points further away than that. Where
/// clustering does not help, as with randomly scattered triangles, every n-th long one represents
/// n. Returns nothing for all other meshes.
std::optional<ClusteredMesh> cluster_long_triangles(MeshView mesh);

/// Lists, ascending, triangles that represent a mesh of many long ones in closest-point queries. If
/// cluster_long_triangles() leaves most of the long ones out, these are every n-th long triangle
/// and all others.
/// Else, as with slivers that share a point, they are all short triangles and, of the long ones
/// with corners in the same cells, one (none if these are two cells and the edge of a listed
/// triangle); each point of the mesh is then within a cell's diagonal of a listed triangle. If they
/// would be half of the mesh or more, and for all other meshes, the list is empty.
std::vector<std::uint32_t> list_representative_triangles(MeshView mesh);

}  // namespace polymorph
