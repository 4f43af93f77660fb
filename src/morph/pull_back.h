// Pull-back map: for the points of a surface between two objects, their positions on the source and
// on the target.
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "morph/plan.h"

namespace polymorph {

/// Positions of each point on the source and on the target, near their surfaces.
struct PullBack {
  std::vector<Vec3> source, target;
  std::vector<float> progress;  ///< eased; 0 unless a smooth map gives it
};

/// Computes X(x) = sum_e q_e (p_e + F_e (x - x_e)) over the pairs e (docs/method.md, Colour). q_e
/// is the share of ball x_e in the field at x, p_e the centre of its source (target) ball, and F_e
/// its map (pair_frames()). At time 0 (1), X on the source (target) is the identity. `balls`:
/// balls_at(plan, time). Errors: the engine's (field/extract_surface.h: to_status).
Result<PullBack> pull_back(const MorphPlan& plan, float time, const BallSet& balls,
                           const std::vector<Vec3>& points, Engine& engine);

/// Unpacks the pull-back from interpolated attributes, two values of four numbers per point: the
/// source's and the target's.
PullBack read_pull_back(const std::vector<AttributeValues>& values);

}  // namespace polymorph
