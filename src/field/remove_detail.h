// An object's distances without its detail. In a surface between two objects, the source's detail
// fades out before the target's fades in (docs/method.md, Surface between).
#pragma once

#include "field/distance_grid.h"
#include "kernels/morph_surface.h"

namespace polymorph {

/// Removes detail from an object's distances: a Gaussian filter with a standard deviation of 0.02
/// size smooths their spline, so that waves of length 0.1 size keep less than half of their
/// amplitude. Where the object is thin, the distances are mixed in with a weight of twice the
/// thinness (at most 1), because a limb is not detail. `distances` and `spline` are the results of
/// compute_signed_distances(), `thinness` is that of compute_thinness() (field/thinness.h), and
/// `size` the diagonal of the object's box in scene units. The result has the grid of `distances`.
/// Deterministic.
DistanceGrid remove_detail(const DistanceGrid& distances, SmoothDistances spline,
                           const DistanceGrid& thinness, float size);

}  // namespace polymorph
