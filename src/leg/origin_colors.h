// Colours of what becomes what: each point has the colour of the place that it comes from (the
// usual picture of a map; Ovsjanikov et al. 2012).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"

namespace polymorph {

/// Traces points of the last leg's surface at `state` back to the object at which the first leg
/// begins, through the times at which the other legs are left. `legs`: one or more, each beginning
/// where the one before it ends. Errors: the engine's.
Result<std::vector<Vec3>> trace_back(std::span<const std::shared_ptr<const Leg>> legs,
                                     const LegState& state, std::vector<Vec3> points,
                                     Engine& engine);

/// Colours points by their places in a box: red, green and blue, sRGB in [0, 1], are its width,
/// height and depth.
std::vector<Vec3> colors_by_place(const std::vector<Vec3>& points, const Box& box);

}  // namespace polymorph
