// Specks that come off a surface.
#pragma once

#include <cstddef>

#include "kernels/mesh.h"

namespace polymorph {

/// Drops the connected parts whose enclosed volume, cavities' too, is below `share` of the whole
/// mesh's. What is left keeps its order. A balls' surface sheds such specks where two balls part;
/// the largest part always stays. Returns how many went.
std::size_t remove_small_components(Mesh& mesh, double share);

/// The share of the whole mesh's volume that its smallest connected part encloses, [0, 1].
double smallest_component_share(const Mesh& mesh);

}  // namespace polymorph
