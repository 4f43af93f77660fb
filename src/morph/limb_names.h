// Names of limbs, for the log.
#pragma once

#include <string>
#include <vector>

#include "morph/limbs.h"

namespace polymorph {

/// Names each limb by its position: "head", "left arm", "front right leg", "tail", or else "limb".
/// Names are unique. Left means smaller x and front larger z before the object was rotated by
/// `angle` radians about the vertical: limbs of a rotated copy have the names of the original's.
std::vector<std::string> limb_names(const Limbs& limbs, double angle = 0);

}  // namespace polymorph
