// Vertex clustering of meshes made of many long triangles, for queries about their shape alone
// (Rossignac and Borrel 1993).
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

/// A stand-in for a mesh: each triangle once, without normals. With `multiplicity` it has the
/// mesh's winding number; without, its shape.
struct ClusteredMesh {
  Mesh mesh;
  std::vector<int> multiplicity;  ///< per triangle, 1 or more
  bool thinned = false;           ///< most of the long triangles are left out
};

/// Counts the triangles that are longer than a 64th of the box's diagonal. Where they are more than
/// 16384 (usual models have some thousands at most), every query about a place concerns nearly all
/// of them, and n queries take n^2 steps.
std::size_t count_long_triangles(MeshView mesh);
bool has_many_long_triangles(std::size_t count);

/// Clusters the points of a mesh of so many long triangles in cells of a 2048th of the diagonal, or
/// of up to eight times that until the long ones are few enough: triangles that lose their extent
/// go, and those that come to lie on their reverse; those that come to lie on each other become one
/// of that multiplicity. No point moves further than across its cell, so the winding number of
/// closed parts stays the same at all points further away from them than that. Where that does not
/// help, as with triangles strewn at random, every n-th of the long ones stands for n. Returns
/// nothing for all other meshes.
std::optional<ClusteredMesh> cluster_long_triangles(MeshView mesh);

}  // namespace polymorph
