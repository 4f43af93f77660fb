// Handles of a closed surface: those that it should not have are cut.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernels/mesh.h"

namespace polymorph {

/// The number of handles of a closed manifold mesh: the sum of its components' genera.
std::int64_t compute_genus(const Mesh& mesh);

/// Cuts handles of a closed manifold mesh until its genus is `genus`. Each step cuts along the
/// shortest loop that bounds no region of the surface, as long as its length is at most
/// `max_length`. Both sides of a cut are closed by a cap and smoothed, so a bridge is severed or a
/// hole filled, whichever is narrower. The mesh stays closed and manifold, and no component falls
/// apart. Returns the number of cuts. Stops early after five million search steps (about a second);
/// above genus 32 a longer loop may be cut before the shortest.
///
/// Guskov, Wood: Topological noise removal (2001). The loops are the shortest through each vertex
/// that are not homologous to zero (modulo 2), found by a tree and a cotree (Erickson, Whittlesey:
/// Greedy optimal homotopy and homology generators, 2005).
std::size_t cut_handles(Mesh& mesh, std::int64_t genus, float max_length);

}  // namespace polymorph
