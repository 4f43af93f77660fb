// Topological noise removal: cuts surplus handles of a closed surface.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernels/mesh.h"

namespace polymorph {

/// Computes the genus of a closed manifold mesh: the number of its handles, summed over its
/// components.
std::int64_t compute_genus(const Mesh& mesh);

/// Cuts handles of a closed manifold mesh until its genus is `genus`. Each step cuts along the
/// shortest loop that bounds no region of the surface, as long as its length is at most
/// `max_length`. Both sides of a cut are closed by a cap and smoothed, so a bridge is severed or a
/// hole filled, whichever is narrower. The mesh stays closed and manifold, and no component falls
/// apart. Returns the number of cuts. Stops early after five million search steps (about a second);
/// above genus 32 a longer loop may be cut before the shortest.
///
/// Method: Guskov, Wood: Topological noise removal (2001). Through each vertex, the shortest loop
/// is found that is not homologous to zero (modulo 2), by a tree-cotree decomposition (Erickson,
/// Whittlesey: Greedy optimal homotopy and homology generators, 2005).
std::size_t cut_handles(Mesh& mesh, std::int64_t genus, float max_length);

}  // namespace polymorph
