// Motion of a plan's balls in time (docs/method.md, Time).
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "morph/parts.h"
#include "morph/plan.h"

namespace polymorph {

/// Works out parts, graph, paths and timing from the plan's pairs and motion settings. plan_morph()
/// calls it; call it again after a change of plan.motion.
void set_paths(MorphPlan& plan);

/// Makes the paths of the balls, each with the rotation and scaling of its part.
void lay_paths(MorphPlan& plan, RigidParts parts);

/// The balls at `time` in [0, 1] of the motion (not eased), one per pair, in pair order. 0 and 1
/// give the fields of `from` and `to` exactly. With u the ball's own eased time:
///   straight: (1-u) p + u q; bezier: the same, all in an arc upwards;
///   rigid: c(u) + s^u exp(u log R) [(1-u) p' + u q'] with the plan's alignment: exact at both
///   ends, and a similarity all the way where one object is a turned and scaled copy of the other.
///   parts: the same, each part (morph/parts.h) with its own rotation, scaling and shift; then an
///   as-rigid-as-possible solve over neighbouring balls.
///   explode: thrown out of p, falling onto the floor, and backwards into q; one fades to the
///   other.
/// Ellipsoids turn with the motion, and the logarithm of their shape is linear. The cube of a
/// ball's size (a^-3/2) is linear, and so is its strength: w for inverse-square balls, w +
/// ln(share) for Gaussian ones.
std::vector<Ball> balls_at(const MorphPlan& plan, float time);

/// Moves the same balls by the engine, which keeps them for the surface. Errors: the engine's
/// (field/extract_surface.h: to_status).
Result<BallSet> balls_at(const MorphPlan& plan, float time, Engine& engine);

/// Places of the plan's landmarks when the balls are balls_at(plan, time): each goes the way of its
/// pair's part. At 0 (1) exactly where it is on the source (target).
std::vector<Vec3> landmark_places(const MorphPlan& plan, float time, const BallSet& balls);
/// Moves other points of both objects in the same manner.
std::vector<Vec3> moved_places(const MorphPlan& plan, std::span<const PlanLandmark> points,
                               float time, const BallSet& balls);

/// Makes a plan whose source is the balls of `before` at `until` continue their velocity, which
/// fades: the balls' centres start with the velocity that they had, whatever the plan's easing, and
/// arrive as they would. `pace`: time of `before` that passes in a unit of this plan's time.
void continue_motion(MorphPlan& plan, const MorphPlan& before, float until, double pace);

/// Takes an offset from a pair's moving ball to the offset from its source (target) ball that it
/// stands for: turned, scaled and stretched as the ball was. The identity at its own end.
struct PairFrame {
  Mat3 to_source, to_target;
};
/// One per pair, for the balls of balls_at(plan, time).
std::vector<PairFrame> pair_frames(const MorphPlan& plan, float time);

/// The eased progress of each pair at `time`, in [0, 1].
std::vector<float> pair_progress(const MorphPlan& plan, float time);

/// Tests whether all balls share one eased time: no stagger and no spring.
bool move_together(const MorphPlan& plan);
/// Each ball's eased time at `time`, at an even pace where the plan has one; a spring's may lie
/// outside [0, 1].
std::vector<float> eased_times(const MorphPlan& plan, float time);
/// Their mean by mass.
float mean_progress(const MorphPlan& plan, const std::vector<float>& eased);
/// The rotation and scaling of all balls, or where each part has a motion of its own their mean
/// by mass, about the objects' centres.
PathPart mean_path_part(const MorphPlan& plan);

/// The progress of the whole object at `time`: the mean of the balls' eased times, by mass, in [0,
/// 1].
float progress_at(const MorphPlan& plan, float time);

}  // namespace polymorph
