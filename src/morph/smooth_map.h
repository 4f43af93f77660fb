// Smooth map from a frame to both objects (kernel regression over the moving balls): for each point
// in space, its position on the source and on the target (docs/method.md, Map).
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

/// Standard deviation of the regression's kernels, and spacing of the lattice on which it is
/// evaluated, as fractions of the objects' size (the diagonal).
inline constexpr double kMapDeviation = 0.055;
inline constexpr float kMapSpacing = 0.04f;

/// The smooth map at one time.
struct FrameMap {
  /// Two maps of four values each. Map 0: the position on the source, then the progress, 0 at the
  /// source and 1 at the target. Map 1: the position on the target, then the weight of
  /// MorphSurface::level (kernels/morph_surface.h).
  std::shared_ptr<const Regression> regression;
  Box box;                             ///< contains the surface
  float from_scale = 1, to_scale = 1;  ///< length in the frame per length on the object
};

/// compute_thinness() of both objects; null: none.
struct ThinnessPair {
  std::shared_ptr<const DistanceGrid> from, to;
};

/// Makes the map X_A(x) = sum_e k_e (p_e + F_e (x - x_e)) / sum_e k_e to the source and a similar
/// map X_B to the target (docs/method.md, Map). The sums are over the pairs e of the plan. x_e is
/// the centre of the pair's moving ball at `time`, p_e the centre of its source ball. F_e undoes
/// the rotation and scaling of e's part (morph/parts.h) since time 0. Pairs on limbs with curves
/// have samples on the centre lines instead (morph/limb_samples.h). The kernel k_e is Gaussian,
/// with a deviation of 5.5 % of `size`, or more for large balls. The deviation is 4 % where limbs
/// are matched, and down to 1.5 % on limbs with curves and where limbs pass each other
/// (morph/passing_limbs.h). At time 0 (1) X_A (X_B) is exactly the identity. At the landmarks'
/// current positions (landmark_positions()), X_A and X_B are exactly the landmarks' points on both
/// objects. `balls`: balls_at(plan, time). `size`: the diagonal of the objects. If `thinness` has
/// both objects, the weights of MorphSurface::level are computed from it (Regression::thinness).
FrameMap frame_map(const MorphPlan& plan, float time, const BallSet& balls, float size,
                   const ThinnessPair& thinness = {});

/// Upper bound of the memory, in bytes, of the lattice values that an engine computes to evaluate a
/// map. It assumes the fine lattice that is used where limbs pass each other. `box`: around the
/// balls; `size`: the diagonal of the smaller object.
double regression_bytes(const Box& box, float size);

/// Copies the regression of a surface's map with other weights of MorphSurface::level (the fourth
/// value of map 1), for a level of -1: the weight is then the distance by which the surface moves
/// outward. Where walls of two objects pass each other by more than their thickness, the mix of
/// their distances is too small, and the surface would tear. The weight of pair e is 1.2 max(0,
/// d(p_e, q_e) - d(X_A(x_e), X_B(x_e))). d(a, b) is the mix, by the smoothstep of the progress, of
/// the source's distance at a and the target's at b; p_e and q_e are the centres of the pair's
/// source and target balls. Only the map, distances and scales of `surface` are used. Errors: the
/// engine's.
Result<std::shared_ptr<const Regression>> make_shortfall_regression(const MorphSurface& surface,
                                                                    const MorphPlan& plan,
                                                                    const BallSet& balls,
                                                                    Engine& engine);

/// Computes the lead of each pair, in [-1, 1]: the difference of the mean geodesic distances
/// (morph/features.h: BallFeatures::distance) of its source and target balls. It is positive if the
/// source ball protrudes more; the pair's progress then runs ahead.
std::vector<float> compute_leads(const MorphPlan& plan);

/// Computes the points' positions on source and target by the map. Errors: the engine's
/// (field/extract_surface.h: to_status).
Result<PullBack> pull_back(const FrameMap& map, const std::vector<Vec3>& points, Engine& engine);

/// Makes the flow as flow_at() of morph/flow.h computes it, but weighted by the map's kernels
/// instead of the balls' shares of the field. `size`: as for frame_map().
std::shared_ptr<const Regression> make_flow_regression(PlanMoment now, PlanMoment next,
                                                       const BallSet& balls, float size);

/// Computes the flow at points. `regression`: make_flow_regression(). Errors: the engine's.
Result<Flow> evaluate_flow(const std::shared_ptr<const Regression>& regression,
                           const std::vector<Vec3>& points, Engine& engine);

}  // namespace polymorph
