// Plan of two objects in other poses than those that it was made for, with the same pairs.
#pragma once

#include "morph/plan.h"
#include "spheres/carry_balls.h"

namespace polymorph {

/// Makes the plan of balls that were moved from the pose of `reference`. Pairs, parts, neighbours,
/// timing and pacing are those of `reference`. Alignments and paths are fitted again, and offsets
/// rotate with their balls. Landmarks are not moved.
MorphPlan posed_plan(const MorphPlan& reference, const CarriedBalls& from, const CarriedBalls& to);

}  // namespace polymorph
