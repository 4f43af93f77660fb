// Crossfade between a model and its balls (Gilbert 2010, 3.3 and 5.2.9): balls grow while the model
// shrinks.
#pragma once

#include <vector>

#include "kernels/types.h"
#include "model/model.h"

namespace polymorph {

/// Computes the point to which each point x of a model shrinks: the mean of the balls' centres,
/// weighted by the squared shares of the balls in the field at x (docs/method.md, Boundary). A
/// handle therefore shrinks into its own balls and not towards the middle of the model.
std::vector<Vec3> shrink_targets(const Model& model, const std::vector<Ball>& balls,
                                 FieldKind kind);

/// Interpolates the model's points from `targets` (boundary = 0) to their own positions
/// (boundary = 1).
std::vector<Vec3> shrunk_points(const Model& model, const std::vector<Vec3>& targets,
                                float boundary);

}  // namespace polymorph
