// Motion of balls along their paths: the position and shape of each ball at a time (the report's
// section 4, 6th step), on either backend. The paths are computed once with the plan
// (src/morph/motion.cpp); a frame only evaluates them. Formulas: docs/method.md, Time.
#pragma once

#include <cstdint>
#include <vector>

#include "host_device.h"
#include "linear.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// Translation, rotation and scaling of one part (a group of balls) on its motion from the source
/// to the target.
struct PathPart {
  Vec3d from_center, to_center;  ///< the part's centre in the source and in the target
  Vec3d rotation_vector;         ///< rotation: axis times angle, radians
  double log_scale = 0;          ///< natural logarithm of the scaling
};

/// Position, scaling and rotation of a part at an eased time u.
struct PartPose {
  Vec3d center;
  double scale = 1;
  Mat3 rotation;
};
/// Returns the pose at eased time u, which is outside [0, 1] where a spring overshoots.
PM_HD inline PartPose part_pose_at(const PathPart& part, double u) {
  return {part.from_center * (1 - u) + part.to_center * u, exp_scalar(part.log_scale * u),
          exp_rotation(part.rotation_vector * u)};
}

/// Returns part_pose_at() of all parts.
inline std::vector<PartPose> part_poses_at(const std::vector<PathPart>& parts, float u) {
  std::vector<PartPose> poses;
  for (const PathPart& part : parts) poses.push_back(part_pose_at(part, static_cast<double>(u)));
  return poses;
}

/// Path of one ball between its two ends. Velocities are in scene units per duration of the motion.
struct BallPath {
  Ball start, end;  ///< the ball at time 0 and at time 1
  Vec3d from, to;   ///< positions relative to the part's centres, both in the source's orientation
  Vec3d bow;        ///< offset from the straight path at u = 1/2
  Vec3d launch;     ///< velocity of both flights at their start, if MotionState::thrown
  Vec3d drift;      ///< velocity left over from the previous motion
  double from_volume = 1, to_volume = 1;  ///< a^-3/2, which is proportional to the volume
  /// Logarithms of the shapes, in the source's orientation; unused if `round`.
  Sym3d from_log, to_log;
  std::uint32_t part = 0;  ///< index in BallPaths::parts
  bool round = true;       ///< whether both ends are round
};
/// The paths of all balls, and the parts with which they move.
struct BallPaths {
  std::vector<BallPath> balls;
  std::vector<PathPart> parts;
};

/// State of a motion that all balls share.
struct MotionState {
  float time = 0;   ///< [0, 1], not eased
  float eased = 0;  ///< eased time of balls that have none of their own
  /// Fraction of a and w that balls lose half way, so that they blend better; [0, 1].
  double softness = 0;
  double drifted = 0;  ///< time for which the balls' drift acts, in durations of the motion
  /// True: balls fly from their start and, backwards in time, from their end; around half way one
  /// flight is blended into the other.
  bool thrown = false;
  double gravity = 0;  ///< scene units per duration squared
  double floor = 0;    ///< height at which balls land, scene units
  double lift = 0;     ///< height by which all balls are raised, scene units (MorphPlan::lifts)
};

/// Returns the softness at eased time u: 0 at the ends, `softness` half way.
PM_HD constexpr double softness_at(double softness, double u) {
  const double parabola = 4 * u * (1 - u);
  return softness * (parabola > 0 ? parabola : 0);
}
/// Returns the factor of the shapes' logarithms at eased time u, in [0, 1]. With softness, balls
/// become rounder half way, because a flat ball (of a lid, say) would stick out of other parts.
PM_HD constexpr double remaining_stretch(double softness, double u) {
  const double stretch = 1 - 2 * softness_at(softness, u);
  return stretch > 0 ? stretch : 0;
}
/// Returns the logarithm of a ball's shape at eased time u, in the source's orientation.
PM_HD constexpr Sym3d log_shape_at(const BallPath& path, double u) {
  return path.from_log * (1 - u) + path.to_log * u;
}
/// Returns a^-3/2 at eased time u. The result is at least a tenth of the smaller end, because a
/// spring may overshoot [0, 1] and must not turn a small volume negative.
PM_HD constexpr double volume_at(const BallPath& path, double u) {
  const double volume = (1 - u) * path.from_volume + u * path.to_volume;
  const double min_volume =
      0.1 * (path.from_volume < path.to_volume ? path.from_volume : path.to_volume);
  return volume > min_volume ? volume : min_volume;
}

/// Returns the position of a ball at `time`, in durations of the motion, after its launch from
/// `start`. A ball lands on the floor or, if it starts below the floor, at the height of its start.
/// It stays where it lands.
PM_HD inline Vec3d flight_position(const MotionState& state, Vec3d start, Vec3d launch,
                                   double time) {
  const double drop = start.y > state.floor ? start.y - state.floor : 0.0;
  double flight = time;
  if (state.gravity > 0) {
    const double landing_time =
        (launch.y + std::sqrt(launch.y * launch.y + 2 * state.gravity * drop)) / state.gravity;
    if (landing_time < flight) flight = landing_time;
  }
  return start + launch * flight - Vec3d{0, state.gravity * flight * flight / 2, 0};
}

/// Returns the ball between its ends, at its eased time u.
PM_HD inline Ball ball_between(const BallPath& path, const MotionState& state, const PathPart& part,
                               const PartPose& pose, double u) {
  Ball ball;
  const Vec3d x = path.from * (1 - u) + path.to * u + path.bow * (4 * u * (1 - u));
  Vec3d center = pose.center + (pose.rotation * x) * pose.scale;
  if (state.thrown) {
    const double clamped_u = u < 0 ? 0 : u > 1 ? 1 : u;
    // A smoothstep from u = 0.2 to 0.8 blends one flight into the other.
    double t = (clamped_u - 0.2) / 0.6;
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    const double blend = t * t * (3 - 2 * t);
    center =
        flight_position(state, part.from_center + path.from, path.launch, clamped_u) * (1 - blend) +
        flight_position(state, part.to_center + path.to, path.launch, 1 - clamped_u) * blend;
  }
  ball.center = to_float(center);
  const double size = cube_root(volume_at(path, u));
  const auto float_u = static_cast<float>(u),
             strength = static_cast<float>(1 - softness_at(state.softness, u));
  ball.a = static_cast<float>(1 / (size * size)) * strength;
  ball.w = ((1 - float_u) * path.start.w + float_u * path.end.w) * strength;
  if (!path.round) {
    const Sym3d log = log_shape_at(path, u) * remaining_stretch(state.softness, u);
    ball.shape = to_sym3(pose.rotation * to_mat3(exp_symmetric(log)) * transposed(pose.rotation));
  }
  return ball;
}

/// Moves each ball along its path; one item per ball.
struct MoveBalls {
  View<const BallPath> paths;
  View<const PathPart> parts;
  View<const PartPose> poses;     ///< per part, at the eased time that all balls share
  View<const float> eased_times;  ///< per ball; empty if all balls share one
  MotionState state;
  View<Ball> balls;

  PM_HD void operator()(std::int64_t e) const {
    if (e >= paths.size) return;
    const BallPath& path = paths[e];
    const float u = eased_times.size > 0 ? eased_times[e] : state.eased;
    Ball ball;
    // At its ends a path has exactly the given balls, without the rounding of powers and rotations.
    if (state.time <= 0 || u == 0) {
      ball = path.start;
    } else if (state.time >= 1 || u == 1) {
      ball = path.end;
    } else {
      const auto double_u = static_cast<double>(u);
      const PathPart& part = parts[path.part];
      ball = ball_between(path, state, part,
                          eased_times.size > 0 ? part_pose_at(part, double_u) : poses[path.part],
                          double_u);
    }
    ball.center = ball.center + to_float(path.drift * state.drifted + Vec3d{0, state.lift, 0});
    balls[e] = ball;
  }
};

}  // namespace polymorph
