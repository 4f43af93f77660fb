// How the surface of moving balls flows: where its points go next, and how far along they are.
#pragma once

#include <span>
#include <vector>

#include "kernels/types.h"
#include "morph/plan.h"

namespace polymorph {

/// One a point.
struct Flow {
  std::vector<Vec3> displacement;  ///< from `time` to `next`, scene units
  std::vector<float> blend;        ///< [0, 1]: eased progress of the balls there, by their shares
};

/// d(x) = sum_e q_e (x_e(next) + G_e (x - x_e) - x), with q_e the share of ball x_e in the field at
/// x and G_e what turns and scales that ball until `next`: the balls' own motion, without what the
/// level does to keep the volume. `balls` are those of balls_at(plan, time); any two times in
/// [0, 1]. Where `next` is `time` only the blend is worked out.
Flow flow_at(const MorphPlan& plan, float time, float next, std::span<const Ball> balls,
             std::span<const Vec3> points);

}  // namespace polymorph
