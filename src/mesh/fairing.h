// Fairing of a surface where its cells are too large for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "kernels/mesh.h"

namespace polymorph {

/// Moves the vertices and those within two edges of them half way to the mean of their neighbours,
/// `steps` times, all at once (the umbrella operator; Kobbelt et al. 1998), and recomputes their
/// normals and those of their neighbours as area-weighted means over the triangles.
void fair(Mesh& mesh, std::span<const std::uint32_t> vertices, int steps);

/// Recomputes the normals that point behind one of their vertex's triangles (cosine below -0.2) as
/// area-weighted means. A field's gradient does so where the surface is thinner than the cells; the
/// vertex would be shaded black there. Returns the number of changed normals.
std::size_t mend_normals(Mesh& mesh);

}  // namespace polymorph
