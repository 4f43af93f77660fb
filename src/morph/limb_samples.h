// Samples of a smooth map along limbs: those of matched limbs lie on both centre lines; those of a
// limb that only one object has let it shrink along its own centre line into its root, or grow out
// of it (docs/method.md, Map).
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/ball_set.h"
#include "morph/plan.h"

namespace polymorph {

/// Sample of a smooth map at a moment, in the place of a pair of balls on a limb.
struct LimbSample {
  std::uint32_t pair = 0;
  bool is_lone = false;
  Vec3 center;                ///< its place now
  Vec3 from, to;              ///< its places on both objects
  Mat3 to_source, to_target;  ///< slopes of the maps to both objects
  double mass = 1;            ///< factor of its weight
  float progress = 0;         ///< is_lone: how far what is here is the target
};

/// The samples of all pairs of which a ball is on a lone limb or both are on one matched limb, in
/// pair order. A lone limb has none where nothing is left of it. `eased`: eased_times(); `balls`:
/// balls_at() of the plan at `time`.
std::vector<LimbSample> limb_samples(const MorphPlan& plan, float time,
                                     const std::vector<float>& eased, const BallSet& balls);

}  // namespace polymorph
