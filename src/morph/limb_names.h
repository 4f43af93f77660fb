// Names of limbs, for the log.
#pragma once

#include <string>
#include <vector>

#include "morph/limbs.h"

namespace polymorph {

/// Names each limb by its position. A name is a noun (head, tail, arm, leg or limb); to make names
/// unique, "front" or "back" and "left" or "right" stand before it, and a number after it: "front
/// right leg". Left means smaller x and front larger z before the object was rotated by `angle`
/// radians about the vertical: limbs of a rotated copy have the names of the original's.
std::vector<std::string> limb_names(const Limbs& limbs, double angle = 0);

}  // namespace polymorph
