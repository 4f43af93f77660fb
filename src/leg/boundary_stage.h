// Boundary stage of an object: precomputed data of the transition between its model and its balls'
// surface. leg/boundary_surface.h makes the surface at a moment of the transition.
#pragma once

#include <variant>
#include <vector>

#include "kernels/types.h"
#include "leg/blend.h"
#include "leg/project.h"

namespace polymorph {

/// Crossfade: the model shrinks while the balls grow.
struct CrossfadeStage {
  std::vector<Vec3> targets;  ///< shrink_targets() (leg/crossfade.h), one per model point
};

/// Data of one of three methods. std::monostate is a cut: the balls replace the model at once.
using BoundaryStage = std::variant<std::monostate, CrossfadeStage, Projection, BlendField>;

}  // namespace polymorph
