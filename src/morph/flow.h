// Motion vectors of the surface of moving balls: the displacement of its points to the next frame,
// and their progress.
#pragma once

#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "morph/plan.h"

namespace polymorph {

/// One per point.
struct Flow {
  std::vector<Vec3> displacement;  ///< change of place between `time` and `next`, scene units
  std::vector<float> progress;     ///< [0, 1]: eased progress of the balls there, by their shares
};

/// A time of a plan's motion.
struct PlanMoment {
  const MorphPlan& plan;
  float time = 0;
};

/// d(x) = sum_e q_e (x_e(next) + G_e (x - x_e) - x), with q_e the share of ball x_e in the field at
/// x and G_e what rotates and scales that ball until `next`: the balls' own motion, without what
/// the level does to keep the volume. `balls` are those of balls_at() now; any two times in [0, 1],
/// of the same plan or of the same pairs in another pose; where `next` is `now` nothing moves.
/// Errors: the engine's (field/extract_surface.h: to_status).
Result<Flow> flow_at(PlanMoment now, PlanMoment next, const BallSet& balls,
                     const std::vector<Vec3>& points, Engine& engine);

/// Tests whether anything is known to move between two moments.
inline bool differ(PlanMoment a, PlanMoment b) { return &a.plan != &b.plan || a.time != b.time; }

/// Reads displacement and progress from the values carried to points.
Flow read_flow(const std::vector<AttributeValues>& values);

}  // namespace polymorph
