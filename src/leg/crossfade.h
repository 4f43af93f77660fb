// Crossfade between a model and its balls (report, 3.3 and 5.2.9): balls grow while the model
// shrinks.
#pragma once

#include <vector>

#include "kernels/types.h"
#include "model/model.h"

namespace polymorph {

/// Computes the point to which each point x of a model shrinks: the mean of the balls' centres,
/// weighted by q_i^2, where q_i is the share of ball i in the field at x (docs/method.md, Field). A
/// handle therefore shrinks into its own balls and not towards the middle of the model.
std::vector<Vec3> shrink_targets(const Model& model, const std::vector<Ball>& balls,
                                 FieldKind kind);

/// Interpolates the model's points from `targets` (boundary = 0) to their own positions
/// (boundary = 1).
std::vector<Vec3> shrunk_points(const Model& model, const std::vector<Vec3>& targets,
                                float boundary);

}  // namespace polymorph
