// Samples of the smooth map on limbs (docs/method.md, Limbs in the map). The samples of matched
// limbs lie on both centre lines. Those of a lone limb, which only one object has, make it shrink
// along its centre line into its root, or grow out of it.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/ball_set.h"
#include "morph/plan.h"

namespace polymorph {

/// Sample of the smooth map at a time. It replaces the sample of a pair of balls on a limb.
struct LimbSample {
  std::uint32_t pair = 0;
  bool is_lone = false;
  Vec3 center;                ///< position at that time
  Vec3 from, to;              ///< positions on both objects
  Mat3 to_source, to_target;  ///< derivatives of the maps to both objects
  double mass = 1;            ///< factor of the sample's weight
  float progress = 0;         ///< lone limbs only: 0 shows the source, 1 the target
};

/// Makes the samples of all pairs with a ball on a lone limb or both balls on the same matched
/// limb, in pair order. A lone limb that has shrunk to nothing has no samples. `eased`:
/// eased_times(plan, time); `balls`: balls_at(plan, time).
std::vector<LimbSample> limb_samples(const MorphPlan& plan, float time,
                                     const std::vector<float>& eased, const BallSet& balls);

}  // namespace polymorph
