// Warp map of a frame (kernel regression over the moving balls): the position on the source and on
// the target of each point in space (docs/method.md, Surface between).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "kernels/morph_surface.h"
#include "morph/flow.h"
#include "morph/plan.h"
#include "morph/pull_back.h"

namespace polymorph {

/// Deviation of a map's kernels, and spacing of its lattice, as shares of the objects' size.
inline constexpr double kMapDeviation = 0.055;
inline constexpr float kMapSpacing = 0.04f;

/// One moment's map, and what lengths are measured by then.
struct FrameMap {
  /// Map 0: to the source, and the progress; map 1: to the target.
  std::shared_ptr<const Regression> regression;
  Box box;                             ///< bounds that the surface stays in
  float from_scale = 1, to_scale = 1;  ///< scene units per unit of either object's lengths
};

/// `balls` are those of balls_at(plan, time), `size` the diagonal of the objects. The regression's
/// kernels have a deviation of 5.5 % of that, wider for large balls, and down to 1.5 % where limbs
/// pass each other (morph/passing_limbs.h): X_A(x) = sum_e k_e (p_e + F_e (x - x_e)) / sum_e k_e,
/// with p_e the ball that x_e comes from and F_e the rotation and scaling since then, undone; X_B
/// likewise. At time 0 (1) X_A (X_B) is the identity exactly. At each landmark's place
/// (landmark_places()) X_A and X_B are where it is on either object. Where both objects'
/// compute_thinness() is given, the level's weights are made of them. The formulas are in
/// docs/method.md, Surface between.
FrameMap frame_map(const MorphPlan& plan, float time, const BallSet& balls, float size,
                   const std::shared_ptr<const DistanceGrid>& from_thinness = nullptr,
                   const std::shared_ptr<const DistanceGrid>& to_thinness = nullptr);

/// Memory of a map's nodes while an engine evaluates them, for a box around the balls and the size
/// of the smaller object: at most, as where limbs pass each other.
double regression_bytes(const Box& box, float size);

/// The map's regression with other level weights, for a level of -1: how far the field of both
/// objects' distances would fall short, at each ball, of what the ball has around it at its ends.
/// Walls that pass each other by more than their thickness are thickened there, and only there,
/// instead of being torn. Errors: the engine's.
Result<std::shared_ptr<const Regression>> with_shortfalls(const FrameMap& map,
                                                          const MorphPlan& plan,
                                                          const BallSet& balls,
                                                          const DistanceGrid& from,
                                                          const DistanceGrid& to, Engine& engine);

/// Computes the lead of each pair, [-1, 1]: how much further out its part is on its source than on
/// its target, by the mean distance along the body to all of it (morph/features.h).
std::vector<float> compute_leads(const MorphPlan& plan);

/// Computes the points' places in source and target by the map. Errors: the engine's
/// (field/extract_surface.h: to_status).
Result<PullBack> pull_back(const FrameMap& map, const std::vector<Vec3>& points, Engine& engine);

/// flow_at() by the map's kernels instead of the balls' shares. Errors: the engine's.
Result<Flow> flow_at(PlanMoment now, PlanMoment next, const BallSet& balls, float size,
                     const std::vector<Vec3>& points, Engine& engine);

}  // namespace polymorph
