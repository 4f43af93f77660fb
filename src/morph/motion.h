// Motion of a plan's balls in time (docs/method.md, Time).
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "morph/parts.h"
#include "morph/plan.h"

namespace polymorph {

/// Computes the plan's parts, graph, paths and timing from its pairs and motion settings.
/// plan_morph() calls this; call it again after changing plan.motion.
void set_paths(MorphPlan& plan);

/// Computes the paths of the balls, each with the rotation and scaling of its part.
void lay_paths(MorphPlan& plan, RigidParts parts);

/// Computes the balls at `time` in [0, 1] of the motion (not eased), one per pair, in pair order. 0
/// and 1 give the fields of `from` and `to` exactly. With u the ball's own eased time:
///   straight: (1-u) p + u q; bezier: the same plus an upward arc that all balls share;
///   rigid: c(u) + s^u exp(u log R) [(1-u) p' + u q'] with the plan's alignment: exact at both
///   ends, and a similarity at every time if one object is a rotated and scaled copy of the other;
///   parts: as rigid, but each part (morph/parts.h) has its own rotation, scaling and translation;
///   an as-rigid-as-possible solve over neighbouring balls then joins the parts;
///   explode: balls are thrown out of p, fall onto the floor, and, in reverse, rise into q; the two
///   flights are crossfaded.
/// Ellipsoids rotate with the motion, and the logarithm of their shape is linear in u. The cube of
/// a ball's size, a^-3/2, is linear, and so is its strength: w + ln(share) in Gaussian fields, w *
/// share in others.
std::vector<Ball> balls_at(const MorphPlan& plan, float time);

/// Computes the same balls on the engine, which keeps them there for extracting the surface.
/// Errors: the engine's (field/extract_surface.h: to_status).
Result<BallSet> balls_at(const MorphPlan& plan, float time, Engine& engine);

/// Computes the positions of the plan's landmarks at `time`. Each moves with the part of its pair.
/// At 0 (1) it is exactly at its point of the source (target). `balls`: balls_at(plan, time).
std::vector<Vec3> landmark_places(const MorphPlan& plan, float time, const BallSet& balls);
/// Computes the positions of `points` in the same way.
std::vector<Vec3> move_points(const MorphPlan& plan, std::span<const PlanLandmark> points,
                              float time, const BallSet& balls);

/// Continues the motion of `before`, whose balls at `until` are the plan's source. The balls start
/// with the velocity that they had then, whatever the plan's easing; it fades out, and they arrive
/// as without it. `pace`: units of the time of `before` per unit of the plan's time.
void continue_motion(MorphPlan& plan, const MorphPlan& before, float until, double pace);

/// Linear maps that take an offset from a pair's moving ball to the corresponding offset from its
/// source (target) ball. They undo the rotation, scaling and stretching of the ball. At its own end
/// a map is the identity.
struct PairFrame {
  Mat3 to_source, to_target;
};
/// Computes the maps of all pairs, for the balls of balls_at(plan, time).
std::vector<PairFrame> pair_frames(const MorphPlan& plan, float time);

/// Scales a matrix.
Mat3 scaled(Mat3 a, double factor);
/// The difference of two matrices.
Mat3 minus(Mat3 a, const Mat3& b);

/// Rotation and scaling of a part: up to an eased time, and from source to target.
struct PartMotion {
  PartPose place;
  Mat3 inv_rotation, total_rotation;  ///< inverse of the rotation so far; rotation to the target
  double total_scale = 1;
  /// The maps that take an offset from that time back to the source, and on to the target.
  Mat3 to_source() const { return scaled(inv_rotation, 1 / place.scale); }
  Mat3 to_target() const {
    return scaled(total_rotation * inv_rotation, total_scale / place.scale);
  }
};
PartMotion part_motion(const PathPart& part, double u);

/// Sets an attribute to a linear map: its value at the ball's centre, and its slope there.
void set_linear(BallAttribute& attribute, Vec3 value, const Mat3& slope);

/// The eased progress of each pair at `time`, in [0, 1].
std::vector<float> pair_progress(const MorphPlan& plan, float time);

/// Tests whether all balls share one eased time: no stagger and no spring.
bool move_together(const MorphPlan& plan);
/// Computes each ball's eased time at `time`. If all balls share one, it follows the plan's pacing.
/// A spring's may lie outside [0, 1].
std::vector<float> eased_times(const MorphPlan& plan, float time);
/// The mean of the balls' eased times, weighted by mass.
float mean_progress(const MorphPlan& plan, const std::vector<float>& eased);
/// The rotation and scaling of all balls. If there are several parts, it is their mean, weighted by
/// mass, about the objects' centres.
PathPart mean_path_part(const MorphPlan& plan);

/// The mean of the balls' eased times at `time`, weighted by mass, in [0, 1]. It ignores the plan's
/// pacing.
float progress_at(const MorphPlan& plan, float time);

}  // namespace polymorph
