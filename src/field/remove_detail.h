// An object's distances without its detail. Between two objects that of the one is gone before that
// of the other comes (docs/method.md, Surface between).
#pragma once

#include "field/distance_grid.h"
#include "kernels/morph_surface.h"

namespace polymorph {

/// Removes detail from an object's distances: a Gaussian with a deviation of 0.02 size passes over
/// their spline, so that waves 0.1 size long keep less than half of their height. Where the object
/// is thin the distances stay, as a limb is no detail: twice the thinness is their share. `spline`
/// is that of compute_signed_distances(), `thinness` that of compute_thinness(), and `size` the
/// object's diagonal in scene units. The result has the grid of `distances`. Deterministic.
DistanceGrid remove_detail(const DistanceGrid& distances, SmoothDistances spline,
                           const DistanceGrid& thinness, float size);

}  // namespace polymorph
