// Plan of two objects in other poses than those for which it was made, with the same pairs.
#pragma once

#include "morph/plan.h"
#include "spheres/carry_balls.h"

namespace polymorph {

/// Makes the plan for balls that carry_balls() moved from the pose of `reference`. Pairs, parts,
/// neighbours, timing and pacing are those of `reference`. Alignments and paths are fitted again.
/// Registration offsets (MorphPlan::from_offsets) rotate with their balls, and limbs' curves move
/// with the nearest balls. Landmarks are not moved: the caller sets them.
MorphPlan posed_plan(const MorphPlan& reference, const CarriedBalls& from, const CarriedBalls& to);

}  // namespace polymorph
