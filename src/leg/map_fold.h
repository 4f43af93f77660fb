// Folds of a leg's map: points at which the map is turned inside out, and landmarks that cause it.
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

/// Marks the points at which one of `maps` (0: to the source, 1: to the target) folds: the
/// determinant of its derivative, by differences over `step` scene units, is not positive. Errors:
/// the engine's.
Result<std::vector<std::uint8_t>> find_folds(const std::shared_ptr<const Regression>& regression,
                                             std::span<const std::size_t> maps,
                                             const std::vector<Vec3>& points, float step,
                                             Engine& engine);

/// Describes how landmarks fold the leg's map; empty if they do not. They do if, of the surface's
/// points at both ends and half way, more than a thousandth are folds of the map but not of the map
/// without landmarks. Empty for legs without landmarks or made of balls. Errors: the engine's.
Result<std::string> describe_fold(const Leg& leg, Engine& engine);

}  // namespace polymorph
