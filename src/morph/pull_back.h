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
  std::vector<float> progress;  ///< eased, [0, 1]; 0 without a smooth map (smooth_map.h)
};

/// Computes X(x) = sum_e q_e (p_e + F_e (x - x_e)) at each of `points` x, once for the source and
/// once for the target (docs/method.md, Colour). The sum is over the plan's pairs e. x_e is the
/// centre of the pair's moving ball, q_e the ball's share of the field at x, p_e the centre of its
/// source (target) ball, and F_e its linear map to it (motion.h: PairMaps). At time 0 (1), X on
/// the source (target) is the identity. `balls`: balls_at(plan, time). Errors: the engine's
/// (field/extract_surface.h: to_status).
Result<PullBack> pull_back(const MorphPlan& plan, float time, const BallSet& balls,
                           const std::vector<Vec3>& points, Engine& engine);

/// Unpacks interpolated attributes, two per point: the first holds the position on the source and
/// the progress, the second the position on the target.
PullBack read_pull_back(const std::vector<AttributeValues>& values);

}  // namespace polymorph
