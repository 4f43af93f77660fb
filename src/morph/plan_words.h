// Text about a plan for the log: the rotation of the object, and the matched limbs.
#pragma once

#include <string>

#include "morph/plan.h"

namespace polymorph {

/// Says, for instance, "turns by 90 degrees about the vertical", or about a tilted axis. Empty if
/// the whole object rotates by less than 5 degrees.
std::string describe_rotation(const MorphPlan& plan);

/// Says, for instance, "head -> head, left arm -> left arm, tail -> nothing". Empty if the plan
/// does not use limbs.
std::string describe_limbs(const MorphPlan& plan);

}  // namespace polymorph
