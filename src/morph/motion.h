// Motion of a plan's balls in time (docs/method.md, Time).
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "morph/parts.h"
#include "morph/plan.h"

namespace polymorph {

/// Computes the plan's parts, graph, paths and timing from its pairs and motion settings. Replaces
/// Path::kAuto by kParts if the plan uses limbs, else by kRigid. plan_morph() calls this; call it
/// again after changing plan.motion.
void set_paths(MorphPlan& plan);

/// Computes the balls' paths (`plan.paths`) from given parts: each ball moves with the rotation and
/// scaling of its part. Also sets `plan.parts`.
void set_ball_paths(MorphPlan& plan, RigidParts parts);

/// Computes the balls at `time` in [0, 1] of the motion (not eased), one per pair, in pair order. 0
/// and 1 give the fields of `from` and `to` exactly. Let u be the ball's own eased time, and p and
/// q the centres of the pair's source and target balls. The path (MotionSettings::path) is
///   straight: (1-u) p + u q;
///   bezier: the straight path plus an upward arc that all balls share;
///   rigid: c(u) + s^u R^u [(1-u) p' + u q']. s and R are the alignment's scale and
///     rotation (MorphPlan::alignment); R^u rotates by u times the angle. c(u) interpolates the
///     objects' centres, p' is p relative to the source's centre, and q' is q relative to the
///     target's, rotated by R^-1 and scaled by 1/s. If one object is a rotated and scaled copy of
///     the other, so is every frame;
///   parts: as rigid, but each part (morph/parts.h) has its own rotation, scaling and translation;
///     an as-rigid-as-possible solve over neighbouring balls then joins the parts;
///   explode: a crossfade of two flights: one thrown from p, which falls onto the floor, and one
///     thrown from q, run backwards.
/// Ellipsoids rotate with the motion, and the logarithm of their shape is linear in u. The cube of
/// a ball's size, a^-3/2, and its strength are linear in u, too. The strength is w + ln(share) in
/// Gaussian fields, w * share in others. Between unlike objects, balls are softer and rounder half
/// way (MotionState::softness).
std::vector<Ball> balls_at(const MorphPlan& plan, float time);

/// Computes the same balls on the engine, which keeps them there for extracting the surface.
/// Errors: the engine's (field/extract_surface.h: to_status).
Result<BallSet> balls_at(const MorphPlan& plan, float time, Engine& engine);

/// Computes the positions of the plan's landmarks at `time`. Each moves with the part and the ball
/// of its pair (PlanLandmark::pair). At 0 (1) it is exactly at its point of the source (target).
/// `balls`: balls_at(plan, time).
std::vector<Vec3> landmark_positions(const MorphPlan& plan, float time, const BallSet& balls);
/// Computes the positions of any points as landmark_positions() does.
std::vector<Vec3> move_points(const MorphPlan& plan, std::span<const PlanLandmark> points,
                              float time, const BallSet& balls);

/// Lets the motion of `plan` continue the motion of `before`, whose balls at its time `until` are
/// the source of `plan`. The balls start with the velocity that they had there, whatever the plan's
/// easing. The difference from their own velocity (BallPath::drift) fades out by the end of the
/// motion. `pace`: time of `before` that passes per unit of the plan's time.
void continue_motion(MorphPlan& plan, const MorphPlan& before, float until, double pace);

/// Linear maps that take an offset from a pair's moving ball to the corresponding offset from its
/// source (target) ball. They undo the rotation, scaling and stretching of the ball. At time 0
/// `to_source` is the identity, and at time 1 `to_target` is.
struct PairMaps {
  Mat3 to_source, to_target;
};
/// Computes the maps of all pairs at `time`.
std::vector<PairMaps> pair_maps(const MorphPlan& plan, float time);

/// Scales a matrix.
Mat3 scaled(Mat3 a, double factor);
/// The difference of two matrices.
Mat3 minus(Mat3 a, const Mat3& b);

/// Rotation and scaling of a part (kernels/ball_paths.h: PathPart) from the source to an eased
/// time, and from the source to the target.
struct PartMotion {
  PartPose pose;  ///< pose at the eased time
  /// Inverse of `pose.rotation`, and the rotation from the source to the target.
  Mat3 inv_rotation, total_rotation;
  double total_scale = 1;  ///< scaling from the source to the target
  /// Linear maps of offsets at the eased time: back to the source, and on to the target.
  Mat3 to_source() const { return scaled(inv_rotation, 1 / pose.scale); }
  Mat3 to_target() const { return scaled(total_rotation * inv_rotation, total_scale / pose.scale); }
};
/// Computes a part's motion at the eased time `u`.
PartMotion part_motion(const PathPart& part, double u);

/// Sets the first three values of an attribute to `value` at the ball's centre, and their
/// derivative by the position to `slope`.
void set_linear(BallAttribute& attribute, Vec3 value, const Mat3& slope);

/// The eased time of each pair at `time`, clamped to [0, 1].
std::vector<float> pair_progress(const MorphPlan& plan, float time);

/// Tests whether all pairs share one eased time: the plan has neither stagger nor a spring.
bool move_together(const MorphPlan& plan);
/// Computes each pair's eased time at `time`. If all share one, it follows the plan's pacing
/// (MorphPlan::pacing). With a spring, eased times may lie outside [0, 1].
std::vector<float> eased_times(const MorphPlan& plan, float time);
/// The mean of the pairs' eased times, weighted by mass. `eased`: eased_times().
float mean_progress(const MorphPlan& plan, const std::vector<float>& eased);
/// The rotation and scaling of the whole object: of its only part or, with several parts, their
/// mean, weighted by mass, about the objects' centres.
PathPart mean_path_part(const MorphPlan& plan);

/// The mean of the pairs' eased times at `time`, weighted by mass and clamped to [0, 1]. It ignores
/// the plan's pacing.
float progress_at(const MorphPlan& plan, float time);

}  // namespace polymorph
