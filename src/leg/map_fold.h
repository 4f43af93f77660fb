// Folds of a leg's map: where landmarks turn it inside out.
#pragma once

#include <string>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"

namespace polymorph {

/// Warns of landmarks that fold the leg's map: the determinant of its derivative is not positive at
/// more than a thousandth of the surface's points at either end or half way, where that of the map
/// without landmarks is. Empty where they do not, and for legs without landmarks or made of balls.
/// Errors: the engine's.
Result<std::string> describe_fold(const Leg& leg, Engine& engine);

}  // namespace polymorph
