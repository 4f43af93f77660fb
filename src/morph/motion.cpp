#include "morph/motion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <span>

#include "base/exact_math.h"
#include "base/parallel.h"
#include "base/random.h"
#include "base/result.h"
#include "field/extract_surface.h"
#include "kernels/field_kinds.h"
#include "morph/easing.h"
#include "morph/parts.h"

namespace polymorph {
namespace {

/// The alignment of a motion without parts: a mere translation, unless the path is rigid.
Alignment path_alignment(const MorphPlan& plan) {
  if (plan.motion.path == Path::kRigid) return plan.alignment;
  Alignment translation;
  translation.from_center = plan.alignment.from_center;
  translation.to_center = plan.alignment.to_center;
  return translation;
}

/// The weight of a ball that contributes only the fraction `share` of the field of a ball of weight
/// `w`.
float strength(FieldKind kind, float w, float share) {
  return visit(kind, [&](auto field) { return field.scale_weight(w, share); });
}

/// The cube of a ball's size, a^-3/2, which is proportional to its volume.
double volume_of_ball(const Ball& ball) {
  const auto a = static_cast<double>(ball.a);
  return 1 / (a * std::sqrt(a));
}

/// Offset of the Bezier paths from the straight ones at half way: upwards, MotionSettings::bend
/// times the RMS distance that the balls travel. All balls share it, because arcs of different
/// heights would tear neighbours apart.
Vec3d bow_vector(const MorphPlan& plan) {
  double squares = 0, mass = 0;
  for (const Pair& pair : plan.pairs) {
    const Vec3d travel = Vec3d(plan.to[pair.to].center) - Vec3d(plan.from[pair.from].center);
    squares += pair.mass * dot(travel, travel);
    mass += pair.mass;
  }
  return {0, static_cast<double>(plan.motion.bend) * std::sqrt(squares / mass), 0};
}

/// The velocity with which a ball is thrown, scene units per motion. Its direction is away from the
/// centre, upwards, and at random; its length is 0.5 to 1 times MotionSettings::burst times the
/// objects' size. `from` and `to` are the ball's positions relative to both objects' centres. The
/// random key is the pair's index, so both ends have the same velocity.
Vec3d launch_velocity(const MorphPlan& plan, std::size_t e, Vec3d from, Vec3d to) {
  const auto random = [&](std::uint64_t stream) {  // in [-1, 1)
    return 2 * static_cast<double>(random_float(plan.motion.seed, stream, e)) - 1;
  };
  const Vec3d direction =
      normalized(from + to) + Vec3d{random(2), 0.8 + random(3), random(4)} * 0.5;
  return normalized(direction) *
         (static_cast<double>(plan.motion.burst) * plan.size * (0.75 + 0.25 * random(5)));
}

/// Each pair's place in the order in which pairs start: 0 for the first, 1 for the last.
std::vector<float> starting_order(const MorphPlan& plan) {
  const std::size_t n = plan.pairs.size();
  // Pairs start in the order of their keys.
  std::vector<double> key(n, 0);
  for (std::size_t e = 0; e < n; ++e) {
    const Pair& pair = plan.pairs[e];
    switch (plan.motion.stagger) {
      case Stagger::kNone:
        break;
      case Stagger::kAxis:
        key[e] = static_cast<double>(dot(plan.from[pair.from].center, plan.motion.stagger_axis));
        break;
      case Stagger::kRadius:
        // The smallest balls, whose `a` is largest, start first.
        key[e] = -static_cast<double>(plan.from[pair.from].a);
        break;
      case Stagger::kLabel:
        key[e] = plan.from_labels.empty() ? 0 : plan.from_labels[pair.from];
        break;
      case Stagger::kNoise:
        // The random key is the source ball, so that all its pairs start together.
        key[e] = static_cast<double>(random_float(plan.motion.seed, 1, pair.from));
        break;
    }
  }
  std::vector<double> sorted = key;
  std::sort(sorted.begin(), sorted.end());
  std::vector<float> order(n, 0);
  // Labels start at equal intervals, whatever their numbers.
  if (plan.motion.stagger == Stagger::kLabel) {
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    for (std::size_t e = 0; e < n && sorted.size() > 1; ++e)
      order[e] = static_cast<float>(
          static_cast<double>(std::lower_bound(sorted.begin(), sorted.end(), key[e]) -
                              sorted.begin()) /
          static_cast<double>(sorted.size() - 1));
    return order;
  }
  // Other pairs start at times proportional to their keys.
  const double range = sorted.back() - sorted.front();
  for (std::size_t e = 0; e < n && range > 0; ++e)
    order[e] = static_cast<float>((key[e] - sorted.front()) / range);
  return order;
}

/// The eased time of pair `e`, with its delay and inertia.
float own_time(const MorphPlan& plan, std::size_t e, float time) {
  const PairTiming& timing = plan.timing[e];
  const float stagger = plan.motion.stagger == Stagger::kNone ? 0.0f : plan.motion.stagger_share;
  const float local_time = std::clamp((time - timing.delay) / (1 - stagger), 0.0f, 1.0f);
  return ease(plan.motion, local_time, timing.inertia);
}

/// The eased time at which the fraction `u` of the change is done: a monotone cubic through the
/// plan's pacing (Fritsch and Carlson 1980). Outside (0, 1), which an easing may reach, it is `u`.
float invert_pacing(const MorphPlan& plan, float u) {
  const std::vector<float>& times = plan.pacing;
  if (times.empty() || u <= 0 || u >= 1) return u;
  const auto last = times.size() - 1;
  const float x = u * static_cast<float>(last);
  const std::size_t k = std::min(static_cast<std::size_t>(x), last - 1);
  const float t = x - static_cast<float>(k);
  const auto secant = [&](std::size_t i) { return times[i + 1] - times[i]; };
  // The harmonic mean of the neighbouring slopes keeps the curve monotone.
  const auto slope = [&](std::size_t i) {
    if (i == 0) return secant(0);
    if (i == last) return secant(last - 1);
    const float a = secant(i - 1), b = secant(i);
    return a > 0 && b > 0 ? 2 * a * b / (a + b) : 0.0f;
  };
  const float t2 = t * t, t3 = t2 * t;
  return times[k] * (2 * t3 - 3 * t2 + 1) + times[k + 1] * (3 * t2 - 2 * t3) +
         slope(k) * (t3 - 2 * t2 + t) + slope(k + 1) * (t3 - t2);
}

/// The height by which all balls are raised when the fraction `u` of the change is done: a linear
/// interpolation of the plan's lifts.
double lift_at(const MorphPlan& plan, float u) {
  const std::vector<float>& lifts = plan.lifts;
  if (lifts.empty() || u <= 0 || u >= 1) return 0;
  const float x = u * static_cast<float>(lifts.size() - 1);
  const std::size_t k = std::min(static_cast<std::size_t>(x), lifts.size() - 2);
  return static_cast<double>(lerp(lifts[k], lifts[k + 1], x - static_cast<float>(k)));
}

/// Joins the parts: moves the balls to the as-rigid-as-possible solution over the graph.
void join_parts(const MorphPlan& plan, std::span<const float> eased, std::vector<Ball>& balls) {
  std::vector<Vec3d> positions;
  std::vector<Mat3> rotations;
  std::vector<double> progress;
  for (std::size_t e = 0; e < balls.size(); ++e) {
    progress.push_back(static_cast<double>(eased[e]));
    positions.emplace_back(balls[e].center);
    rotations.push_back(
        exp_rotation(plan.parts[plan.paths->balls[e].part].rotation_vector * progress[e]));
  }
  const std::vector<Vec3d> joined_positions =
      plan.graph->join_balls(positions, rotations, progress);
  for (std::size_t e = 0; e < balls.size(); ++e) balls[e].center = to_float(joined_positions[e]);
}

/// Softness of the moving balls. Balls that were fitted to one surface become visible one by one
/// when they part. Lowering weight and falloff together keeps a ball's radius and blends it into
/// its neighbours. The softness is 0 between near copies, which must keep their shape.
double softness(const MorphPlan& plan) {
  if (!visit(plan.kind, [](auto field) { return decltype(field)::kExponential; })) return 0;
  // Strain up to which the softness is 0, and from which on it is kSoften.
  constexpr double kAlike = 0.05, kUnlike = 0.25;
  // Fraction of the falloff that balls between unlike objects lose half way.
  constexpr double kSoften = 0.5;
  return kSoften * std::clamp((plan.alignment.strain - kAlike) / (kUnlike - kAlike), 0.0, 1.0);
}

/// Factor of the drift, t (1 - t)^2: unit velocity at time 0; value and velocity 0 at 1.
double drift_weight(float time) {
  const double t = std::clamp(static_cast<double>(time), 0.0, 1.0);
  return t * (1 - t) * (1 - t);
}

/// The pairs' own eased times; empty if all share one.
std::vector<float> own_times(const MorphPlan& plan, float time) {
  return move_together(plan) ? std::vector<float>() : eased_times(plan, time);
}

MotionState make_motion_state(const MorphPlan& plan, float time) {
  MotionState state;
  state.time = time;
  state.eased = invert_pacing(plan, ease(plan.motion, time));
  state.softness = softness(plan);
  // With a graph, finish_motion() adds the drift after the parts are joined.
  state.drifted = plan.graph ? 0 : drift_weight(time);
  state.thrown = plan.motion.path == Path::kExplode;
  // 10 sizes per motion squared: with a factor of 1, balls come down within the motion.
  state.gravity = 10 * static_cast<double>(plan.motion.gravity) * plan.size;
  state.floor = plan.floor;
  state.lift = lift_at(plan, ease(plan.motion, time));
  return state;
}

/// Moves balls along their paths. `own`: own_times().
std::vector<Ball> move_on_host(const std::vector<BallPath>& paths,
                               const std::vector<PathPart>& parts, const std::vector<float>& own,
                               const MotionState& state) {
  std::vector<Ball> balls(paths.size());
  const std::vector<PartPose> poses = part_poses_at(parts, state.eased);
  const auto view = [](const auto& array) {
    return View(array.data(), static_cast<std::int64_t>(array.size()));
  };
  const MoveBalls move = {view(paths), view(parts),
                          view(poses), view(own),
                          state,       {balls.data(), static_cast<std::int64_t>(balls.size())}};
  parallel_for(static_cast<std::int64_t>(balls.size()), move, /*grain=*/256);
  return balls;
}

/// Joins the parts, if there is a graph, and then adds the drift.
void finish_motion(const MorphPlan& plan, float time, std::vector<Ball>& balls) {
  if (!plan.graph) return;
  if (time > 0 && time < 1) join_parts(plan, eased_times(plan, time), balls);
  for (std::size_t e = 0; e < balls.size(); ++e)
    balls[e].center = balls[e].center + to_float(plan.paths->balls[e].drift * drift_weight(time));
}

}  // namespace

bool move_together(const MorphPlan& plan) {
  return plan.motion.stagger == Stagger::kNone && plan.motion.easing != Easing::kSpring;
}

std::vector<float> eased_times(const MorphPlan& plan, float time) {
  if (move_together(plan))
    return std::vector<float>(plan.pairs.size(), invert_pacing(plan, ease(plan.motion, time)));
  std::vector<float> eased;
  for (std::size_t e = 0; e < plan.pairs.size(); ++e) eased.push_back(own_time(plan, e, time));
  return eased;
}

float mean_progress(const MorphPlan& plan, const std::vector<float>& eased) {
  double sum = 0, mass = 0;
  for (std::size_t e = 0; e < eased.size(); ++e) {
    sum += plan.pairs[e].mass * static_cast<double>(eased[e]);
    mass += plan.pairs[e].mass;
  }
  // The mean of equal times may differ from them by rounding.
  const bool all_equal =
      std::all_of(eased.begin(), eased.end(), [&](float u) { return u == eased[0]; });
  return all_equal ? eased[0] : static_cast<float>(sum / mass);
}

PathPart mean_path_part(const MorphPlan& plan) {
  const std::vector<PathPart>& parts = plan.paths->parts;
  if (parts.size() == 1) return parts[0];
  PathPart mean = {Vec3d{}, Vec3d{}, Vec3d{}, 0};
  double mass = 0;
  for (std::size_t e = 0; e < plan.pairs.size(); ++e) {
    const PathPart& part = parts[plan.paths->balls[e].part];
    const double m = plan.pairs[e].mass;
    mean.rotation_vector = mean.rotation_vector + part.rotation_vector * m;
    mean.log_scale += part.log_scale * m;
    mass += m;
  }
  return {plan.alignment.from_center, plan.alignment.to_center, mean.rotation_vector * (1 / mass),
          mean.log_scale / mass};
}

void set_ball_paths(MorphPlan& plan, RigidParts parts) {
  plan.parts = std::move(parts.alignments);
  const Vec3d bow = plan.motion.path == Path::kBezier ? bow_vector(plan) : Vec3d{};
  BallPaths paths;
  for (const Alignment& part : plan.parts)
    paths.parts.push_back(
        {part.from_center, part.to_center, part.rotation_vector, exact::log(part.scale)});
  paths.balls.resize(plan.pairs.size());
  for (std::size_t e = 0; e < paths.balls.size(); ++e) {
    const Pair& pair = plan.pairs[e];
    const Ball& p = plan.from[pair.from];
    const Ball& q = plan.to[pair.to];
    BallPath& path = paths.balls[e];
    path.part = parts.part_of[e];
    const Alignment& alignment = plan.parts[path.part];
    const Mat3 inv_rotation = transposed(alignment.rotation);
    path.start = p;
    path.end = q;
    path.start.w = strength(plan.kind, p.w, pair.from_share);
    path.end.w = strength(plan.kind, q.w, pair.to_share);
    // Both ends are relative to the part's centres; the target's is rotated and scaled back to the
    // source.
    path.from = Vec3d(p.center) - alignment.from_center;
    path.to = inv_rotation * (Vec3d(q.center) - alignment.to_center) * (1 / alignment.scale);
    path.from_volume = volume_of_ball(p);
    path.to_volume = volume_of_ball(q);
    path.round = is_round(p) && is_round(q);
    if (!path.round) {
      path.from_log = to_sym3d(log_symmetric(to_mat3(p.shape)));
      path.to_log = to_sym3d(inv_rotation * log_symmetric(to_mat3(q.shape)) * alignment.rotation);
    }
    path.bow = bow;
    if (plan.motion.path == Path::kExplode)
      path.launch = launch_velocity(plan, e, path.from, path.to);
  }
  plan.paths = std::make_shared<const BallPaths>(std::move(paths));
}

void set_paths(MorphPlan& plan) {
  RigidParts parts;
  plan.graph.reset();
  // With matched limbs, paths by parts let the limbs swing about their joints.
  if (plan.motion.path == Path::kAuto)
    plan.motion.path = plan.from_limbs.empty() ? Path::kRigid : Path::kParts;
  if (plan.motion.path == Path::kParts) {
    parts = rigid_parts(plan);
    plan.graph = std::make_shared<const BallGraph>(plan, parts);
  } else {
    parts.alignments = {path_alignment(plan)};
    parts.part_of.assign(plan.pairs.size(), 0);
  }
  set_ball_paths(plan, std::move(parts));
  const std::vector<float> order = starting_order(plan);
  const auto count = static_cast<double>(plan.pairs.size());
  plan.timing.assign(plan.pairs.size(), {});
  for (std::size_t e = 0; e < plan.pairs.size(); ++e) {
    PairTiming& timing = plan.timing[e];
    if (plan.motion.stagger != Stagger::kNone) timing.delay = order[e] * plan.motion.stagger_share;
    constexpr double kMaxRatio = 8;  // max ratio of a mass to the mean, and of the mean to a mass
    timing.inertia = static_cast<float>(
        exact::pow(std::clamp(plan.pairs[e].mass * count, 1 / kMaxRatio, kMaxRatio),
                   static_cast<double>(plan.motion.spring.lag)));
  }
}

std::vector<Ball> balls_at(const MorphPlan& plan, float time) {
  PM_CHECK(plan.paths && plan.paths->balls.size() == plan.pairs.size());
  std::vector<Ball> balls = move_on_host(plan.paths->balls, plan.paths->parts,
                                         own_times(plan, time), make_motion_state(plan, time));
  finish_motion(plan, time, balls);
  return balls;
}

Result<BallSet> balls_at(const MorphPlan& plan, float time, Engine& engine) {
  BallSet balls;
  PM_TRY_STATUS(to_status(
      engine.move_balls(plan.paths, make_motion_state(plan, time), own_times(plan, time), balls)));
  if (!plan.graph) return balls;
  std::vector<Ball> finished_balls = balls.balls();
  finish_motion(plan, time, finished_balls);
  return BallSet(std::move(finished_balls));
}

std::vector<Vec3> landmark_positions(const MorphPlan& plan, float time, const BallSet& balls) {
  return move_points(plan, plan.landmarks, time, balls);
}

std::vector<Vec3> move_points(const MorphPlan& plan, std::span<const PlanLandmark> points,
                              float time, const BallSet& balls) {
  if (points.empty()) return {};
  // A point moves on a path of its own in its pair's part. The graph and the drift displace the
  // pair's ball from its path; the point is displaced in the same way. `paths` holds, per point,
  // the point's path and its pair's path.
  const std::vector<float> own = own_times(plan, time);
  BallPaths paths;
  std::vector<float> times;
  for (const PlanLandmark& landmark : points) {
    BallPath pair_path = plan.paths->balls[landmark.pair], path;
    pair_path.drift = {};
    const Alignment& alignment = plan.parts[pair_path.part];
    path.start.center = landmark.from;
    path.end.center = landmark.to;
    path.from = Vec3d(landmark.from) - alignment.from_center;
    path.to = transposed(alignment.rotation) * (Vec3d(landmark.to) - alignment.to_center) *
              (1 / alignment.scale);
    path.bow = pair_path.bow;
    path.part = pair_path.part;
    paths.balls.push_back(path);
    paths.balls.push_back(pair_path);
    if (!own.empty()) times.insert(times.end(), 2, own[landmark.pair]);
  }
  const std::vector<Ball> moved_balls =
      move_on_host(paths.balls, plan.paths->parts, times, make_motion_state(plan, time));
  std::vector<Vec3> positions;
  for (std::size_t l = 0; l < points.size(); ++l)
    positions.push_back(moved_balls[2 * l].center +
                        (balls[points[l].pair].center - moved_balls[2 * l + 1].center));
  return positions;
}

void continue_motion(MorphPlan& plan, const MorphPlan& before, float until, double pace) {
  PM_CHECK(plan.from.size() == before.pairs.size());
  constexpr float kStep = 1.0f / 128;  // step of the finite differences, in the motion's time
  const auto steps_per_unit = 1 / static_cast<double>(kStep);
  const std::vector<Ball> balls_before = balls_at(before, until - kStep),
                          balls_after = balls_at(before, until + kStep);
  // The initial velocity of the new motion, by a one-sided difference of second order.
  const std::vector<Ball> own_positions[3] = {balls_at(plan, 0), balls_at(plan, kStep),
                                              balls_at(plan, 2 * kStep)};
  BallPaths paths = *plan.paths;
  for (std::size_t e = 0; e < paths.balls.size(); ++e) {
    const std::uint32_t i = plan.pairs[e].from;
    const Vec3d previous_velocity = (Vec3d(balls_after[i].center) - Vec3d(balls_before[i].center)) *
                                    (0.5 * steps_per_unit * pace);
    const Vec3d own_velocity =
        (Vec3d(own_positions[1][e].center) * 4 - Vec3d(own_positions[0][e].center) * 3 -
         Vec3d(own_positions[2][e].center)) *
        (0.5 * steps_per_unit);
    paths.balls[e].drift = previous_velocity - own_velocity;
  }
  plan.paths = std::make_shared<const BallPaths>(std::move(paths));
}

std::vector<PairMaps> pair_maps(const MorphPlan& plan, float time) {
  const std::vector<float> eased = eased_times(plan, time);
  const double max_softness = softness(plan);
  std::vector<PairMaps> maps(plan.pairs.size());
  parallel_for(
      static_cast<std::int64_t>(maps.size()),
      [&](std::int64_t index) {
        const auto e = static_cast<std::size_t>(index);
        const BallPath& path = plan.paths->balls[e];
        const auto u = static_cast<double>(eased[e]);
        const Alignment& alignment = plan.parts[path.part];
        const Mat3 inv_rotation = transposed(exp_rotation(alignment.rotation_vector * u));
        // shape^1/2 maps an ellipsoid to a ball. The map to an end undoes the part's rotation, maps
        // the moving ellipsoid to a ball, and this ball to the ellipsoid at that end.
        Mat3 from = inv_rotation, to = inv_rotation;
        if (!path.round) {
          const auto power = [](const Sym3d& log, double exponent) {
            return to_mat3(exp_symmetric(log * exponent));
          };
          const Mat3 half_power =
              power(log_shape_at(path, u), 0.5 * remaining_stretch(max_softness, u)) * inv_rotation;
          from = power(path.from_log, -0.5) * half_power;
          to = power(path.to_log, -0.5) * half_power;
        }
        to = alignment.rotation * to;
        const double size = cube_root(volume_at(path, u));
        const double from_size = cube_root(path.from_volume) / size;
        const double to_size = cube_root(path.to_volume) / size;
        maps[e] = {scaled(from, from_size), scaled(to, to_size)};
      },
      /*grain=*/256);
  return maps;
}

Mat3 scaled(Mat3 a, double factor) {
  for (double& v : a.m) v *= factor;
  return a;
}

Mat3 minus(Mat3 a, const Mat3& b) {
  for (int i = 0; i < 9; ++i) a.m[i] -= b.m[i];
  return a;
}

PartMotion part_motion(const PathPart& part, double u) {
  const PartPose pose = part_pose_at(part, u);
  return {pose, transposed(pose.rotation), exp_rotation(part.rotation_vector),
          exp_scalar(part.log_scale)};
}

void set_linear(BallAttribute& attribute, Vec3 value, const Mat3& slope) {
  attribute.value[0] = value.x, attribute.value[1] = value.y, attribute.value[2] = value.z;
  for (int i = 0; i < 3; ++i)
    attribute.slope[i] = to_float({slope.at(i, 0), slope.at(i, 1), slope.at(i, 2)});
}

std::vector<float> pair_progress(const MorphPlan& plan, float time) {
  std::vector<float> progress = eased_times(plan, time);
  for (float& u : progress) u = std::clamp(u, 0.0f, 1.0f);
  return progress;
}

float progress_at(const MorphPlan& plan, float time) {
  if (move_together(plan)) return std::clamp(ease(plan.motion, time), 0.0f, 1.0f);
  double sum = 0, mass = 0;
  for (std::size_t e = 0; e < plan.pairs.size(); ++e) {
    sum +=
        plan.pairs[e].mass * static_cast<double>(std::clamp(own_time(plan, e, time), 0.0f, 1.0f));
    mass += plan.pairs[e].mass;
  }
  return static_cast<float>(std::clamp(sum / mass, 0.0, 1.0));
}

}  // namespace polymorph
