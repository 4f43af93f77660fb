// Medial ball cover: a greedy set cover of the boundary by medial balls.
#pragma once

#include <cstddef>
#include <vector>

#include "spheres/boundary.h"
#include "spheres/spheres.h"

namespace polymorph {

/// Covers the boundary samples with `count` balls, or slightly fewer if the samples do not allow
/// more. Candidates are the samples' inner shrinking balls (BoundarySample::inner_radius). They are
/// chosen greedily by the number of uncovered samples p with |p - c| <= r + delta, where c and r
/// are the ball's centre and radius. The dilation delta is bisected so that `count` balls suffice.
/// The balls are in the order in which they are chosen, so any prefix is a coarser cover.
std::vector<Sphere> make_medial_cover(const std::vector<BoundarySample>& samples,
                                      std::size_t count);

/// Builds a tree of covers of count, count / 8, count / 64, ... balls; the parent of a ball is the
/// ball of the next coarser cover that it lies deepest in. The finest level is the flat
/// approximation.
SphereTree build_medial_tree(const std::vector<BoundarySample>& samples, std::size_t count);

}  // namespace polymorph
