// Names of limbs, for the log.
#pragma once

#include <string>
#include <vector>

#include "morph/limbs.h"

namespace polymorph {

/// A name for each limb, as far as its place tells what it is: "head", "left arm", "front right
/// leg", "tail", else "limb"; no two are the same. Left is where x is smaller, front where z is
/// larger: nobody knows which way the object faces.
std::vector<std::string> limb_names(const Limbs& limbs);

}  // namespace polymorph
