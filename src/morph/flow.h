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
  std::vector<Vec3> displacement;  ///< scene units
  std::vector<float> progress;     ///< mean eased progress of the balls at the point, [0, 1]
};

/// A time of a plan's motion.
struct PlanMoment {
  const MorphPlan& plan;
  float time = 0;
};

/// Computes d(x) = sum_e q_e (x_e(next) + G_e (x - x_e) - x) at `points`. q_e is the share of ball
/// x_e in the field at x, and G_e rotates and scales that ball from `now` to `next`. The level's
/// change, which keeps the volume, is left out. `balls`: balls_at(now.plan, now.time). The times
/// are any two in [0, 1], of the same plan or of plans with the same pairs in two poses. Errors:
/// the engine's (field/extract_surface.h: to_status).
Result<Flow> flow_at(PlanMoment now, PlanMoment next, const BallSet& balls,
                     const std::vector<Vec3>& points, Engine& engine);

/// Tests whether two moments differ, in plan or time; if not, nothing moves between them.
inline bool differ(PlanMoment a, PlanMoment b) { return &a.plan != &b.plan || a.time != b.time; }

/// Unpacks displacement and progress from the attributes that flow_at() interpolates at points.
Flow read_flow(const std::vector<AttributeValues>& values);

}  // namespace polymorph
