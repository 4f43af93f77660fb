// Where an object is thin, from its signed distances: what the level between two objects spares
// (docs/method.md, Surface between).
#pragma once

#include "kernels/morph_surface.h"

namespace polymorph {

/// How thin an object is around each point of a coarse grid, in [0, 1]. On the medial axis of a
/// part whose half thickness is h it is max(0, 1 - (h / (0.06 size))^2); from there it falls by 1
/// over 0.1 size, and beyond the grid it is 0. If the mean of 1 - thinness over the object is below
/// 1/2, all values are multiplied by twice that mean. The medial axis is where the distances'
/// gradient is short, without the branches into edges and corners. `size`: the object's diagonal,
/// in its units. Deterministic.
DistanceGrid thinness(const DistanceGrid& distances, float size);

}  // namespace polymorph
