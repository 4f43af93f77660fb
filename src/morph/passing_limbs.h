// Limbs that pass each other on their way: a smooth map must not mix them (docs/method.md, Surface
// between).
#pragma once

#include <vector>

#include "kernels/ball_set.h"
#include "morph/plan.h"

namespace polymorph {

/// Computes how far each pair's ball passes one of another matched limb, [0, 1]: 1 where that is
/// near, and much nearer than at either end. 0 at both ends, in no limb, and in plans without
/// limbs. `eased`: eased_times(); `balls`: balls_at() then; `size`: the objects' diagonal.
std::vector<float> passing_shares(const MorphPlan& plan, const std::vector<float>& eased,
                                  const BallSet& balls, float size);

}  // namespace polymorph
