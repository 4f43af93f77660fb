// Fairing of a surface where its cells are too large for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "kernels/mesh.h"

namespace polymorph {

/// Moves the vertices and those within two edges of them half way to the middle of their
/// neighbours, `steps` times, all at once (the umbrella operator; Kobbelt et al. 1998), and gives
/// them and their neighbours the mesh's own normals: means over the triangles, weighted by area.
void fair(Mesh& mesh, std::span<const std::uint32_t> vertices, int steps);

/// Gives those vertices the mesh's own normals whose normal points behind one of their triangles,
/// by a fifth of its length at least. A field's gradient does so where the surface is thinner than
/// the cells, and would be shaded black there. Returns how many there were.
std::size_t mend_normals(Mesh& mesh);

}  // namespace polymorph
