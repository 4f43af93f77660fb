// Handles of a closed surface: those that it should not have are cut.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernels/mesh.h"

namespace polymorph {

/// The number of handles of a closed manifold mesh: the sum of its components' genera.
std::int64_t genus_of(const Mesh& mesh);

/// Cuts handles of a closed manifold mesh until its genus is `genus`: along the shortest loop that
/// bounds no part of the surface, again and again, as long as that is no longer than `longest`.
/// Either side of a cut is closed by a cap and smoothed: a bridge is cut through or a hole filled,
/// whichever is narrower. The mesh stays closed and manifold, and no component falls apart. Returns
/// how many were cut. Stops short where the search takes more than five million steps, a second or
/// so; above genus 32 a longer loop may be cut before the shortest.
///
/// Guskov, Wood: Topological noise removal (2001). The loops are the shortest through each vertex
/// that are not homologous to zero (modulo 2), told by a tree and a cotree (Erickson, Whittlesey:
/// Greedy optimal homotopy and homology generators, 2005).
std::size_t cut_handles(Mesh& mesh, std::int64_t genus, float longest);

}  // namespace polymorph
