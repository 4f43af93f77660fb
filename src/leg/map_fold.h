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

/// Marks (1; others 0) the points at which one of the maps of a regression with two maps
/// (kernels/morph_surface.h) folds. A map folds where the determinant of its derivative, by
/// differences over `step` scene units, is not positive. `maps`: indices of the maps that are
/// tested: 0, the map to the source, and 1, the map to the target. Errors: the engine's.
Result<std::vector<std::uint8_t>> find_folds(const std::shared_ptr<const Regression>& regression,
                                             std::span<const std::size_t> maps,
                                             const std::vector<Vec3>& points, float step,
                                             Engine& engine);

/// Describes how landmarks fold the leg's map. Returns an empty text if they do not fold it, if
/// there are none, or if the leg is made of balls. Landmarks fold the map if more than a thousandth
/// of the surface's points at both ends and half way are folds of the map, but not of the map
/// without landmarks. Errors: the engine's.
Result<std::string> describe_fold(const Leg& leg, Engine& engine);

}  // namespace polymorph
