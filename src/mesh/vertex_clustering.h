// Vertex clustering of meshes made of many long triangles, for queries about their shape alone
// (Rossignac and Borrel 1993).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

/// A simplified mesh without normals, in which no two triangles coincide. If each counts
/// `multiplicity` times, the winding number is about the original's.
struct ClusteredMesh {
  Mesh mesh;
  std::vector<int> multiplicity;  ///< per triangle, 1 or more
  bool thinned = false;           ///< most of the long triangles are left out
  double cell = 0;                ///< edge length of the cells
};

/// Counts the triangles that are longer than a 64th of the box's diagonal.
std::size_t count_long_triangles(MeshView mesh);
/// Tests whether the number of long triangles is above 16384 (usual models have some thousands at
/// most). Every local query then visits nearly all long triangles, and n queries take n^2 steps.
bool has_many_long_triangles(std::size_t count);

/// Clusters the points of a mesh that has_many_long_triangles() in cubic cells; returns nothing for
/// all other meshes. The edge of a cell is a 2048th of the diagonal and is doubled, at most three
/// times, until few long triangles remain. Triangles that collapse are removed, as are pairs that
/// coincide with opposite orientation; n triangles that coincide become one of multiplicity n. No
/// point leaves its cell, so the winding number of closed components does not change at points
/// further from them than a cell's diagonal. If too many long triangles remain, as with randomly
/// scattered ones, every n-th of them stays, with its multiplicity times n.
std::optional<ClusteredMesh> cluster_long_triangles(MeshView mesh);

/// Lists, ascending, triangles that represent a mesh of many long triangles in closest-point
/// queries. If cluster_long_triangles() leaves out most of the long triangles, the list has every
/// n-th long triangle and all short ones. Else the list has all short triangles and, of all long
/// triangles with corners in the same three cells, one. Of those with corners in the same two
/// cells, it has one, or none if the two cells are an edge of a listed long triangle. Each point of
/// the mesh is then within a cell's diagonal of a listed triangle. The list is empty if it would
/// have half of the mesh's triangles or more, and for all other meshes.
std::vector<std::uint32_t> list_representative_triangles(MeshView mesh);

}  // namespace polymorph
