// Limbs that pass each other during the motion; a smooth map must not mix them (docs/method.md,
// Map).
#pragma once

#include <vector>

#include "kernels/ball_set.h"
#include "morph/plan.h"

namespace polymorph {

/// Computes c_e of docs/method.md for each pair, in [0, 1]: how closely its ball passes a ball of
/// another matched limb. It is 1 if that ball is near, and much nearer than at either end. It is 0
/// at both ends and for balls in no limb. `eased`: eased_times(); `balls`: balls_at() at the same
/// time; `size`: the objects' diagonal.
std::vector<float> passing_weights(const MorphPlan& plan, const std::vector<float>& eased,
                                   const BallSet& balls, float size);

}  // namespace polymorph
