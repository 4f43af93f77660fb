// Folds of a leg's map: points at which it is inside out, and landmarks that make it so.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"

namespace polymorph {

/// Marks the points at which one of these maps (0: to the source, 1: to the target) is inside out:
/// the determinant of its derivative, by differences over `step` in scene units, is not positive.
/// Errors: the engine's.
Result<std::vector<std::uint8_t>> find_folds(const std::shared_ptr<const Regression>& regression,
                                             std::span<const std::size_t> maps,
                                             const std::vector<Vec3>& points, float step,
                                             Engine& engine);

/// Warns of landmarks that fold the leg's map: the determinant of its derivative is not positive at
/// more than a thousandth of the surface's points at either end or half way, where that of the map
/// without landmarks is. Empty where they do not, and for legs without landmarks or made of balls.
/// Errors: the engine's.
Result<std::string> describe_fold(const Leg& leg, Engine& engine);

}  // namespace polymorph
