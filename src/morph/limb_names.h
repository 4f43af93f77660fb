// Names of limbs, for the log.
#pragma once

#include <string>
#include <vector>

#include "morph/limbs.h"

namespace polymorph {

/// Names each limb by its position: "head", "left arm", "front right leg", "tail", or else "limb".
/// Names are unique. Left means smaller x and front larger z, whichever way the object faces.
std::vector<std::string> limb_names(const Limbs& limbs);

}  // namespace polymorph
