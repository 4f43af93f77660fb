// Plan of two objects in other poses than those that it was made for: who becomes whom stays.
#pragma once

#include "morph/plan.h"
#include "spheres/carry_balls.h"

namespace polymorph {

/// The plan when its objects' balls were carried elsewhere. Pairs, parts, neighbours, timing and
/// pace are those of `reference`; alignments and paths are made anew, and offsets turn with their
/// balls. Landmarks stay where they are.
MorphPlan posed_plan(const MorphPlan& reference, const CarriedBalls& from, const CarriedBalls& to);

}  // namespace polymorph
