// Names of limbs, for the log.
#pragma once

#include <string>
#include <vector>

#include "morph/limbs.h"

namespace polymorph {

/// Names each limb by its position: "head", "left arm", "front right leg", "tail", else "limb"; no
/// two names are the same. Left is where x is smaller and front where z is larger, although the
/// object may face elsewhere.
std::vector<std::string> limb_names(const Limbs& limbs);

}  // namespace polymorph
