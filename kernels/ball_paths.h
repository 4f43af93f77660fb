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

/// The rotation and scaling of a part of the balls, from its source to its target.
struct PathPart {
  Vec3d from_center, to_center;
  Vec3d turn;            ///< axis times angle
  double log_scale = 0;  ///< natural logarithm
};

/// A part at an eased time.
struct PartPlace {
  Vec3d center;
  double scale = 1;
  Mat3 rotation;
};
PM_HD inline PartPlace place_at(const PathPart& part, double u) {
  return {part.from_center * (1 - u) + part.to_center * u, exp_scalar(part.log_scale * u),
          exp_rotation(part.turn * u)};
}

/// All parts at an eased time.
inline std::vector<PartPlace> places_at(const std::vector<PathPart>& parts, float u) {
  std::vector<PartPlace> places;
  for (const PathPart& part : parts) places.push_back(place_at(part, static_cast<double>(u)));
  return places;
}

/// Path of one ball, as its two ends determine it.
struct BallPath {
  Ball start, end;  ///< the balls at the ends themselves
  Vec3d from, to;   ///< about the part's centres, both in the source's orientation
  Vec3d bow;        ///< offset from the straight path half way
  Vec3d launch;     ///< thrown out of either end: scene units per motion
  Vec3d drift;      ///< remainder of an earlier motion: scene units per motion
  double from_volume = 1, to_volume = 1;  ///< a^-3/2
  Sym3d from_log,
      to_log;  ///< logarithms of the shapes, in the source's orientation; unused when round
  std::uint32_t part = 0;
  bool round = true;
};
struct BallPaths {
  std::vector<BallPath> balls;
  std::vector<PathPart> parts;
};

/// State of a motion that all balls share.
struct MotionState {
  float time = 0;       ///< [0, 1], not eased
  float eased = 0;      ///< eased time of balls that have none of their own
  double softness = 0;  ///< balls that part melt into each other by this (docs/method.md, Time)
  double drifted = 0;   ///< fraction of the balls' drift that is applied
  bool thrown =
      false;  ///< balls fly from both ends, and change from one flight to the other half way
  double gravity = 0;  ///< scene units per motion squared
  double floor = 0;    ///< height where they land
  double lift = 0;     ///< height by which all are raised between the ends (MorphPlan::lifts)
};

/// Softness of the balls at an eased time, [0, 1]: 0 at the ends, all of it half way.
PM_HD constexpr double softness_at(double softness, double u) {
  const double middle = 4 * u * (1 - u);
  return softness * (middle > 0 ? middle : 0);
}
/// Remaining fraction of the shapes' logarithm: half way between unlike objects balls are round,
/// because a flat one (a lid's) would stick out of other parts.
PM_HD constexpr double remaining_stretch(double softness, double u) {
  const double stretch = 1 - 2 * softness_at(softness, u);
  return stretch > 0 ? stretch : 0;
}
/// The logarithm of a ball's shape at an eased time, in the source's orientation.
PM_HD constexpr Sym3d log_shape_at(const BallPath& path, double u) {
  return path.from_log * (1 - u) + path.to_log * u;
}
/// a^-3/2 at an eased time. An overshooting spring must not turn a small volume negative.
PM_HD constexpr double volume_at(const BallPath& path, double u) {
  const double volume = (1 - u) * path.from_volume + u * path.to_volume;
  const double min_volume =
      0.1 * (path.from_volume < path.to_volume ? path.from_volume : path.to_volume);
  return volume > min_volume ? volume : min_volume;
}

/// Position of a ball that was thrown from `start` a time ago; it stays where it lands.
PM_HD inline Vec3d flight_position(const MotionState& moment, Vec3d start, Vec3d launch,
                                   double time) {
  const double drop = start.y > moment.floor ? start.y - moment.floor : 0.0;
  double flight = time;
  if (moment.gravity > 0) {
    const double landing_time =
        (launch.y + std::sqrt(launch.y * launch.y + 2 * moment.gravity * drop)) / moment.gravity;
    if (landing_time < flight) flight = landing_time;
  }
  return start + launch * flight - Vec3d{0, moment.gravity * flight * flight / 2, 0};
}

/// The ball between its ends, at its eased time u.
PM_HD inline Ball ball_between(const BallPath& path, const MotionState& moment,
                               const PathPart& part, const PartPlace& place, double u) {
  Ball ball;
  const Vec3d x = path.from * (1 - u) + path.to * u + path.bow * (4 * u * (1 - u));
  Vec3d center = place.center + (place.rotation * x) * place.scale;
  if (moment.thrown) {
    const double v = u < 0 ? 0 : u > 1 ? 1 : u;
    double middle = (v - 0.2) / 0.6;
    middle = middle < 0 ? 0 : middle > 1 ? 1 : middle;
    const double into = middle * middle * (3 - 2 * middle);
    center = flight_position(moment, part.from_center + path.from, path.launch, v) * (1 - into) +
             flight_position(moment, part.to_center + path.to, path.launch, 1 - v) * into;
  }
  ball.center = to_float(center);
  const double size = cube_root(volume_at(path, u));
  const auto v = static_cast<float>(u),
             weaker = static_cast<float>(1 - softness_at(moment.softness, u));
  ball.a = static_cast<float>(1 / (size * size)) * weaker;
  ball.w = ((1 - v) * path.start.w + v * path.end.w) * weaker;
  if (!path.round) {
    const Sym3d log = log_shape_at(path, u) * remaining_stretch(moment.softness, u);
    ball.shape = to_sym3(place.rotation * to_mat3(exp_symmetric(log)) * transposed(place.rotation));
  }
  return ball;
}

/// Moves each ball along its path; one item per ball.
struct MoveBalls {
  View<const BallPath> paths;
  View<const PathPart> parts;
  View<const PartPlace> places;   ///< per part, where all balls share the eased time
  View<const float> eased_times;  ///< per ball otherwise
  MotionState moment;
  View<Ball> balls;

  PM_HD void operator()(std::int64_t e) const {
    if (e >= paths.size) return;
    const BallPath& path = paths[e];
    const float u = eased_times.size > 0 ? eased_times[e] : moment.eased;
    Ball ball;
    // At the ends the given balls, free of the rounding of powers and rotations.
    if (moment.time <= 0 || u == 0) {
      ball = path.start;
    } else if (moment.time >= 1 || u == 1) {
      ball = path.end;
    } else {
      const auto v = static_cast<double>(u);
      const PathPart& part = parts[path.part];
      ball = ball_between(path, moment, part,
                          eased_times.size > 0 ? place_at(part, v) : places[path.part], v);
    }
    ball.center = ball.center + to_float(path.drift * moment.drifted + Vec3d{0, moment.lift, 0});
    balls[e] = ball;
  }
};

}  // namespace polymorph
