// Samples of the smooth map (morph/smooth_map.h) on limbs (docs/method.md, Limbs in the map).
// Samples of matched limbs lie on the centre lines of both. A lone limb, which only one object has,
// gets samples that let it shrink along its centre line into its root, or grow out of it.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/ball_set.h"
#include "morph/plan.h"

namespace polymorph {

/// A sample of the smooth map at one time. It replaces the sample that a pair of balls would give.
struct LimbSample {
  std::uint32_t pair = 0;     ///< index of the pair of balls
  bool is_lone = false;       ///< whether it lies on a lone limb
  Vec3 center;                ///< position at that time
  Vec3 from, to;              ///< positions on both objects
  Mat3 to_source, to_target;  ///< derivatives of the maps to both objects at `center`
  double mass = 1;            ///< factor of the sample's weight in the map
  float progress = 0;         ///< lone limbs only: 0 shows the source, 1 the target
};

/// Makes samples for the pairs that have a ball on a lone limb and for those whose balls are on the
/// same matched limb, in pair order. A lone limb that has shrunk to nothing has no samples.
/// `eased`: eased_times(plan, time); `balls`: balls_at(plan, time).
std::vector<LimbSample> limb_samples(const MorphPlan& plan, float time,
                                     const std::vector<float>& eased, const BallSet& balls);

}  // namespace polymorph
