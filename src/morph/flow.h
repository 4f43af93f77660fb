// Motion vectors of the surface of moving balls: the displacement of its points to the next frame,
// and their progress.
#pragma once

#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "morph/plan.h"

namespace polymorph {

/// Motion vectors at points. Both lists have one element per point.
struct Flow {
  std::vector<Vec3> displacement;  ///< scene units
  std::vector<float> progress;     ///< mean pair_progress() (morph/motion.h) of the balls there
};

/// A plan and a time of its motion, [0, 1].
struct PlanMoment {
  const MorphPlan& plan;
  float time = 0;
};

/// Computes the displacement d(x) = sum_e share_e (x'_e + G_e (x - x_e) - x) of each of `points` x
/// from `now` to `next`. The sum is over the plan's pairs e. x_e and x'_e are the centres of the
/// pair's ball at `now` and at `next`, share_e is the ball's share of the field at x, and G_e
/// rotates and scales offsets from the ball as it moves. The level of the field, which changes to
/// keep the volume, is taken as constant. `balls`: balls_at(now.plan, now.time). The two moments
/// may have any times. Their plans are the same, or plans of the same pairs in two poses. Errors:
/// the engine's (field/extract_surface.h: to_status).
Result<Flow> flow_at(PlanMoment now, PlanMoment next, const BallSet& balls,
                     const std::vector<Vec3>& points, Engine& engine);

/// Tests whether two moments differ, in plan or time. Between equal moments nothing moves.
inline bool differ(PlanMoment a, PlanMoment b) { return &a.plan != &b.plan || a.time != b.time; }

/// Unpacks interpolated attributes into a flow: values 0 to 2 of a point are its displacement,
/// value 3 is its progress.
Flow read_flow(const std::vector<AttributeValues>& values);

}  // namespace polymorph
