// Thinness of an object's parts, from its signed distances. The level of a surface between two
// objects moves less at thin parts (docs/method.md, Surface between).
#pragma once

#include "kernels/morph_surface.h"

namespace polymorph {

/// Computes the thinness of an object around each point of a coarse grid, in [0, 1]. On the medial
/// axis of a part with half thickness h it is max(0, 1 - (h / (0.06 size))^2), with `size` the
/// diagonal of the object's box in scene units. From there it decreases by 1 over 0.1 size, and
/// beyond the grid it is 0. The medial axis is where the distances' gradient is short; its branches
/// into edges and corners are left out. Deterministic.
DistanceGrid compute_thinness(const DistanceGrid& distances, float size);

/// Multiplies an object's thinness by min(1, 2 m), with m the mean of 1 - thinness over the object:
/// the level (MorphSurface::level) must move even an object that is thin everywhere.
DistanceGrid limit_thinness(DistanceGrid thinness, const DistanceGrid& distances);

}  // namespace polymorph
