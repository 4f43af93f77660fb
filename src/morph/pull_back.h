// Pull-back map: for the points of a surface between two objects, their positions on the source and
// on the target.
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "morph/plan.h"

namespace polymorph {

/// For each point, the positions on the source and on the target that correspond to it. They are
/// near the surfaces, not exactly on them.
struct PullBack {
  std::vector<Vec3> source, target;
  /// Eased time of each point, 0 at the source and 1 at the target. Only a smooth map
  /// (smooth_map.h) yields it; pull_back() sets 0.
  std::vector<float> progress;
};

/// Computes X(x) = sum_e share_e (p_e + F_e (x - x_e)) at each of `points` x, once for the source
/// and once for the target (docs/method.md, Colour). The sum is over the plan's pairs e. x_e is the
/// centre of the pair's moving ball, share_e the ball's share of the field at x, p_e the centre of
/// its source (target) ball, and F_e the linear map of offsets in the moving ball to offsets in
/// that one (motion.h: PairMaps). At time 0 (1), X on the source (target) is the identity. `balls`:
/// balls_at(plan, time). Errors: the engine's (field/extract_surface.h: to_status).
Result<PullBack> pull_back(const MorphPlan& plan, float time, const BallSet& balls,
                           const std::vector<Vec3>& points, Engine& engine);

/// Unpacks the values that interpolate_attributes() or the regression of a smooth map yields, two
/// per point: the first holds the position on the source and the progress, the second the position
/// on the target.
PullBack read_pull_back(const std::vector<AttributeValues>& values);

}  // namespace polymorph
