// Pull-back map: for the points of a surface between two objects, their positions on the source and
// on the target.
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "morph/plan.h"

namespace polymorph {

/// One per point: its place on the source and on the target, near their surfaces.
struct PullBack {
  std::vector<Vec3> source, target;
  std::vector<float> progress;  ///< eased, of what is there; by a smooth map, else 0
};

/// X(x) = sum_e q_e (p_e + F_e (x - x_e)) over the pairs e, with q_e the share of ball x_e in the
/// field at x, p_e the ball it comes from (goes to) and F_e its frame (pair_frames). `balls` are
/// those of balls_at(plan, time). At time 0 (1) X is the point itself, on the source (target)
/// (docs/method.md, Colour).
/// Errors: the engine's (field/extract_surface.h: to_status).
Result<PullBack> pull_back(const MorphPlan& plan, float time, const BallSet& balls,
                           const std::vector<Vec3>& points, Engine& engine);

/// Reads the pull-back from the values carried to points, two quadruples each: the source's and the
/// target's.
PullBack read_pull_back(const std::vector<AttributeValues>& values);

}  // namespace polymorph
