// Medial ball cover: a greedy set cover of the boundary by medial balls.
#pragma once

#include <cstddef>
#include <vector>

#include "spheres/boundary.h"
#include "spheres/spheres.h"

namespace polymorph {

/// `count` balls, or a few less where the samples allow no more, that cover the boundary samples:
/// candidates are the samples' inner shrinking balls (Ma et al. 2012), chosen greedily by how many
/// uncovered samples p they hold, |p - c| <= r + delta, with the dilation delta bisected so that
/// `count` of them suffice. In the order in which they were chosen: any prefix is the cover's own
/// coarser version.
std::vector<Sphere> medial_cover(const std::vector<BoundarySample>& samples, std::size_t count);

/// The tree: covers of count, count / 8, count / 64, ... balls, each ball the child of the coarser
/// ball that it lies deepest in. The finest level is the flat list.
SphereTree medial_tree(const std::vector<BoundarySample>& samples, std::size_t count);

}  // namespace polymorph
