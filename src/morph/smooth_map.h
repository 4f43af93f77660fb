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

/// Deviation of the map's kernels and spacing of its lattice, as fractions of the objects' size.
inline constexpr double kMapDeviation = 0.055;
inline constexpr float kMapSpacing = 0.04f;

/// The map at one time, with its bounds and the scales of both objects.
struct FrameMap {
  /// Map 0: the position on the source, and the progress; map 1: the position on the target, and
  /// the level's weight (MorphSurface::map).
  std::shared_ptr<const Regression> regression;
  Box box;                             ///< contains the surface
  float from_scale = 1, to_scale = 1;  ///< scene units per unit of either object's lengths
};

/// Makes the map X_A(x) = sum_e k_e (p_e + F_e (x - x_e)) / sum_e k_e to the source, and likewise
/// X_B to the target (docs/method.md, Map). The sums are over the moving balls e, whose centres are
/// x_e at `time`. p_e is the centre of the source ball that e comes from, and F_e undoes the
/// rotation and scaling that e's part of the path has made since the start. The kernels k_e have a
/// deviation of 5.5 % of `size`; it is larger for large balls, 4 % where limbs are matched, and
/// down to 1.5 % where limbs pass each other (morph/passing_limbs.h). At time 0 (1) X_A (X_B) is
/// exactly the identity. At the landmarks (landmark_places()), X_A and X_B are exactly their points
/// on both objects. `balls`: balls_at(plan, time); `size`: the diagonal of the objects. If
/// compute_thinness() of both objects is given, the weights of MorphSurface::level are computed
/// from it.
FrameMap frame_map(const MorphPlan& plan, float time, const BallSet& balls, float size,
                   const std::shared_ptr<const DistanceGrid>& from_thinness = nullptr,
                   const std::shared_ptr<const DistanceGrid>& to_thinness = nullptr);

/// Upper bound of the memory, in bytes, that a map's nodes take while an engine evaluates them:
/// that of the fine lattice used where limbs pass each other. `box`: around the balls; `size`: the
/// diagonal of the smaller object.
double regression_bytes(const Box& box, float size);

/// Makes the map's regression with other weights of MorphSurface::level, which is to be -1: the
/// weight is then the distance by which the surface moves outward. That of a ball is the amount by
/// which the mix of both objects' distances is smaller there than at the ball's ends.
/// Where the walls of two objects pass each other by more than their thickness, this thickens the
/// surface instead of tearing it. Errors: the engine's.
Result<std::shared_ptr<const Regression>> add_shortfall_weights(
    const FrameMap& map, const MorphPlan& plan, const BallSet& balls, const DistanceGrid& from,
    const DistanceGrid& to, Engine& engine);

/// Computes the lead of each pair, [-1, 1]: how much more its source ball protrudes than its target
/// ball, by their mean geodesic distances (morph/features.h: BallFeatures::distance).
std::vector<float> compute_leads(const MorphPlan& plan);

/// Computes the points' positions on source and target by the map. Errors: the engine's
/// (field/extract_surface.h: to_status).
Result<PullBack> pull_back(const FrameMap& map, const std::vector<Vec3>& points, Engine& engine);

/// Computes the flow as in morph/flow.h, but weighted by the map's kernels instead of the balls'
/// shares of the field. Errors: the engine's.
Result<Flow> flow_at(PlanMoment now, PlanMoment next, const BallSet& balls, float size,
                     const std::vector<Vec3>& points, Engine& engine);

}  // namespace polymorph
