// Boundary stage of an object: the data of the steps from its model to its balls' surface and back
// (leg/boundary_surface.h has them at a moment).
#pragma once

#include <variant>
#include <vector>

#include "kernels/types.h"
#include "leg/blend.h"
#include "leg/project.h"

namespace polymorph {

/// Crossfade: the model shrinks while the balls grow.
struct CrossfadeStage {
  std::vector<Vec3> targets;  ///< shrink_targets(): one per model point
};

/// No stage (a cut: the model is followed by its balls), or one of three methods.
using BoundaryStage = std::variant<std::monostate, CrossfadeStage, Projection, BlendField>;

}  // namespace polymorph
