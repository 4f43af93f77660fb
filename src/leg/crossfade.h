// Crossfade between a model and its balls (the report's boundary morph, 3.3 and 5.2.9): balls grow
// while the model shrinks.
#pragma once

#include <vector>

#include "kernels/types.h"
#include "model/model.h"

namespace polymorph {

/// The point that each point of a model shrinks to: the share-weighted centre of the balls around
/// it, so that a handle shrinks into the handle's balls and not towards the middle of everything
/// (method: the field's shares q_i; docs/method.md, Field).
std::vector<Vec3> shrink_targets(const Model& model, const std::vector<Ball>& balls,
                                 FieldKind kind);

/// The model's points at `boundary`: 1 = whole, 0 = shrunk into its balls.
std::vector<Vec3> shrunk_points(const Model& model, const std::vector<Vec3>& targets,
                                float boundary);

}  // namespace polymorph
