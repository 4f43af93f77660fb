// Where an object is thin, from its signed distances: what the level between two objects spares
// (docs/method.md, Surface between).
#pragma once

#include "kernels/morph_surface.h"

namespace polymorph {

/// How thin an object is around each point of a coarse grid, in [0, 1]: on the middle of a part of
/// half thickness h 1 - (h / (0.06 size))^2, 0 where that is negative, and falling from there by 1
/// over 0.1 size. Beyond the grid it is 0. Where all of that leaves less than half of the object,
/// it is less everywhere, in proportion. The middle of a part is where the distances' gradient
/// vanishes, the medial axis but for its branches into edges and corners. `size`: the object's
/// diagonal, in its units. Deterministic.
DistanceGrid thinness(const DistanceGrid& distances, float size);

}  // namespace polymorph
