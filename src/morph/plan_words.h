// Words for a plan: the turn of the whole, and which limb becomes which.
#pragma once

#include <string>

#include "morph/plan.h"

namespace polymorph {

/// "turns by 90 degrees about the vertical", or about a tilted axis; empty where nothing turns by 5
/// degrees or more as a whole.
std::string describe_turn(const MorphPlan& plan);

/// "head -> head, left arm -> left arm, tail -> nothing"; empty where the plan is made without
/// limbs.
std::string describe_limbs(const MorphPlan& plan);

}  // namespace polymorph
