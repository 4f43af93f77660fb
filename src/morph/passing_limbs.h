// Limbs that pass each other during the motion. A smooth map (morph/smooth_map.h) must not mix them
// (docs/method.md, Map).
#pragma once

#include <vector>

#include "kernels/ball_set.h"
#include "morph/plan.h"

namespace polymorph {

/// Computes for each pair how closely its ball passes a ball of another matched limb, in [0, 1]
/// (c_e of docs/method.md). The weight is 1 if the other ball is near now, and much nearer than at
/// either end of the motion. It is 0 at both ends and for pairs that belong to no limb. `eased`:
/// eased_times(); `balls`: balls_at() at the same time; `size`: the objects' diagonal.
std::vector<float> passing_weights(const MorphPlan& plan, const std::vector<float>& eased,
                                   const BallSet& balls, float size);

}  // namespace polymorph
