// Text about a plan for the log: the rotation of the object, and the matched limbs.
#pragma once

#include <string>

#include "morph/plan.h"

namespace polymorph {

/// Describes the rotation: "turns by N degrees about the vertical" or "... about a tilted axis".
/// Empty if the whole object rotates by less than 5 degrees, or the balls' paths are straight.
std::string describe_rotation(const MorphPlan& plan);

/// Lists what each limb becomes: "head -> head, tail -> nothing". Empty if the plan does not use
/// limbs.
std::string describe_limbs(const MorphPlan& plan);

}  // namespace polymorph
