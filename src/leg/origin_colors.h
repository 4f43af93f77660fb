// Colours that show a map: each point has the colour of the point that it comes from. This is the
// usual picture of a correspondence (Ovsjanikov et al. 2012).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"

namespace polymorph {

/// Traces points of the last leg's surface at `state` back to the source of the first leg. `legs`:
/// one or more. Each leg but the first has the previous leg as its Leg::before, or begins at the
/// previous leg's target. Errors: the engine's.
Result<std::vector<Vec3>> trace_back(std::span<const std::shared_ptr<const Leg>> legs,
                                     const LegState& state, std::vector<Vec3> points,
                                     Engine& engine);

/// Colours points by their positions in a box: red, green and blue, sRGB in [0, 1], grow along its
/// width, height and depth.
std::vector<Vec3> colors_by_position(const std::vector<Vec3>& points, const Box& box);

}  // namespace polymorph
