// Mesh fairing: local smoothing of vertices, and repair of vertex normals.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "kernels/mesh.h"

namespace polymorph {

/// Smooths `vertices` and those within two edges of them by the umbrella operator (Kobbelt et al.
/// 1998): in each of `steps` steps, all of them move half way to the mean of their neighbours. Then
/// recomputes their normals and those of their neighbours as area-weighted means over the
/// triangles.
void fair(Mesh& mesh, std::span<const std::uint32_t> vertices, int steps);

/// Recomputes, as area-weighted means, the vertex normals that have a cosine below -0.2 with the
/// normal of an adjacent triangle. Gradients of a field give such normals where an object is
/// thinner than the grid's cells; the vertex would be shaded black. Returns the number of changed
/// normals.
std::size_t repair_normals(Mesh& mesh);

}  // namespace polymorph
