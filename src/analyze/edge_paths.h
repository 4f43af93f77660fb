// Geodesic distance along a mesh's edges (Dijkstra 1959).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

/// Computes the length of the shortest path along edges between the points of each pair; infinite
/// if they are not connected. The path is longer than the shortest path over the surface, by a
/// tenth on nearly equilateral triangles. Parallel, deterministic.
std::vector<double> edge_path_lengths(
    MeshView mesh, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs);

}  // namespace polymorph
