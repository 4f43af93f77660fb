#include "morph/motion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <span>

#include "base/parallel.h"
#include "base/random.h"
#include "base/result.h"
#include "morph/easing.h"
#include "morph/parts.h"

namespace polymorph {
namespace {

/// What all balls turn and grow with.
Alignment path_alignment(const MorphPlan& plan) {
  if (plan.motion.path == Path::kRigid) return plan.alignment;
  Alignment straight;
  straight.from_center = plan.alignment.from_center;
  straight.to_center = plan.alignment.to_center;
  return straight;
}

float strength(FieldKind kind, float w, float share) {
  return kind == FieldKind::kGaussian ? w + std::log(share) : w * share;
}

double volume_of_ball(const Ball& ball) {
  const auto a = static_cast<double>(ball.a);
  return 1 / (a * std::sqrt(a));
}

/// Which way a path bows: out, away from the middle of both objects.
Vec3d bow_of(const MorphPlan& plan, Vec3d p, Vec3d q) {
  const Vec3d way = q - p;
  const double far = length(way);
  if (!(far > 0)) return {};
  const Vec3d along = way * (1 / far);
  const Vec3d middle = (plan.alignment.from_center + plan.alignment.to_center) * 0.5;
  const Vec3d out = (p + q) * 0.5 - middle;
  const Vec3d side = out - along * dot(out, along);
  // One that goes straight through the middle bows nowhere.
  return normalized(side) * (far * static_cast<double>(plan.motion.bend));
}

/// Which way and how fast a ball is thrown: out from the middle, up, and at random. Keyed by the
/// pair's number, which is the same on the way back.
Vec3d launch_of(const MorphPlan& plan, std::size_t e, Vec3d from, Vec3d to) {
  const auto random = [&](std::uint64_t stream) {
    return 2 * static_cast<double>(random_float(plan.motion.seed, stream, e)) - 1;
  };
  const Vec3d way = normalized(from + to) + Vec3d{random(2), 0.8 + random(3), random(4)} * 0.5;
  return normalized(way) *
         (static_cast<double>(plan.motion.burst) * plan.size * (0.75 + 0.25 * random(5)));
}

/// Where a ball is that was thrown from `start` at `launch` a time ago; it stays where it lands.
Vec3d thrown(const MorphPlan& plan, Vec3d start, Vec3d launch, double time) {
  const double gravity = 10 * static_cast<double>(plan.motion.gravity) * plan.size;
  const double drop = std::max(start.y - plan.floor, 0.0);
  double flight = time;
  if (gravity > 0)
    flight =
        std::min(time, (launch.y + std::sqrt(launch.y * launch.y + 2 * gravity * drop)) / gravity);
  return start + launch * flight - Vec3d{0, gravity * flight * flight / 2, 0};
}

/// Each pair's place in the order of starting, [0, 1].
std::vector<float> starting_order(const MorphPlan& plan) {
  const std::size_t n = plan.pairs.size();
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
        key[e] = -static_cast<double>(plan.from[pair.from].a);
        break;
      case Stagger::kLabel:
        key[e] = plan.from_labels.empty() ? 0 : plan.from_labels[pair.from];
        break;
      case Stagger::kNoise:
        // Keyed by the ball: its parts start together.
        key[e] = static_cast<double>(random_float(plan.motion.seed, 1, pair.from));
        break;
    }
  }
  std::vector<double> sorted = key;
  std::sort(sorted.begin(), sorted.end());
  std::vector<float> order(n, 0);
  if (plan.motion.stagger == Stagger::kLabel) {
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    for (std::size_t e = 0; e < n && sorted.size() > 1; ++e)
      order[e] = static_cast<float>(
          static_cast<double>(std::lower_bound(sorted.begin(), sorted.end(), key[e]) -
                              sorted.begin()) /
          static_cast<double>(sorted.size() - 1));
    return order;
  }
  const double span = sorted.back() - sorted.front();
  for (std::size_t e = 0; e < n && span > 0; ++e)
    order[e] = static_cast<float>((key[e] - sorted.front()) / span);
  return order;
}

float own_time(const MorphPlan& plan, std::size_t e, float time) {
  const Mover& mover = plan.movers[e];
  const float share = plan.motion.stagger == Stagger::kNone ? 0.0f : plan.motion.stagger_share;
  const float own = std::clamp((time - mover.delay) / (1 - share), 0.0f, 1.0f);
  return ease(plan.motion, own, mover.inertia);
}

/// Without stagger or spring all balls share one u.
bool move_together(const MorphPlan& plan) {
  return plan.motion.stagger == Stagger::kNone && plan.motion.easing != Easing::kSpring;
}

/// What all balls of one eased time share: c(u), s^u, exp(u log R).
struct Place {
  Vec3d center;
  double scale = 1;
  Mat3 rotation;
};

Place place_at(const Alignment& alignment, double u) {
  return {alignment.from_center * (1 - u) + alignment.to_center * u, std::pow(alignment.scale, u),
          exp_rotation(alignment.turn * u)};
}

/// Puts the balls where the graph of their neighbours wants them.
void join(const MorphPlan& plan, std::span<const double> progress, std::vector<Ball>& balls) {
  std::vector<Vec3d> places;
  std::vector<Mat3> turns;
  for (std::size_t e = 0; e < balls.size(); ++e) {
    places.emplace_back(balls[e].center);
    turns.push_back(exp_rotation(plan.parts[plan.movers[e].part].turn * progress[e]));
  }
  const std::vector<Vec3d> joined = plan.graph->joined(places, turns, progress);
  for (std::size_t e = 0; e < balls.size(); ++e) balls[e].center = to_float(joined[e]);
}

/// Balls that were fitted to one surface stand out singly when they part. With weight and falloff
/// lowered together a ball keeps its own radius and melts into its neighbours. Not where the balls
/// keep their order: a turned copy must stay what it is.
double softness(const MorphPlan& plan) {
  if (plan.kind != FieldKind::kGaussian) return 0;
  // Strain up to which they count as alike, and from which on as wholly unlike.
  constexpr double kAlike = 0.05, kUnlike = 0.25;
  return static_cast<double>(plan.motion.soften) *
         std::clamp((plan.alignment.strain - kAlike) / (kUnlike - kAlike), 0.0, 1.0);
}

/// What is left of the shapes' logarithm: half way between unlike objects balls are round. A disc
/// that was a lid's would stick out of whatever it passes.
double stretch_left(const MorphPlan& plan, double u) {
  return std::max(1 - 2 * softness(plan) * 4 * std::max(u * (1 - u), 0.0), 0.0);
}

/// log of the shape, in the source's orientation, times `factor`.
Mat3 log_shape_at(const Mover& mover, double u, double factor) {
  Mat3 log;
  for (std::size_t k = 0; k < 9; ++k)
    log.m[k] = factor * ((1 - u) * mover.from_log.m[k] + u * mover.to_log.m[k]);
  return log;
}

Sym3 shape_at(const Mover& mover, const Mat3& rotation, double u, double stretch) {
  return to_sym3(rotation * exp_symmetric(log_shape_at(mover, u, stretch)) * transposed(rotation));
}

/// a^-3/2. An overshooting spring must not turn a small volume negative.
double volume_at(const Mover& mover, double u) {
  return std::max((1 - u) * mover.from_volume + u * mover.to_volume,
                  0.1 * std::min(mover.from_volume, mover.to_volume));
}

/// How much of a ball's drift shows: a unit velocity at time 0, nothing left of it at 1.
double drifted(float time) {
  const double t = std::clamp(static_cast<double>(time), 0.0, 1.0);
  return t * (1 - t) * (1 - t);
}

/// A ball between its ends.
Ball between(const MorphPlan& plan, const Mover& mover, const Place& place, double u) {
  Ball ball;
  Vec3d x = mover.from * (1 - u) + mover.to * u;
  if (plan.motion.path == Path::kBezier) x = x + mover.bow * (4 * u * (1 - u));
  Vec3d center = place.center + (place.rotation * x) * place.scale;
  if (plan.motion.path == Path::kExplode) {
    const double v = std::clamp(u, 0.0, 1.0);
    const double middle = std::clamp((v - 0.2) / 0.6, 0.0, 1.0);
    const double into = middle * middle * (3 - 2 * middle);
    center = thrown(plan, plan.alignment.from_center + mover.from, mover.launch, v) * (1 - into) +
             thrown(plan, plan.alignment.to_center + mover.to, mover.launch, 1 - v) * into;
  }
  ball.center = to_float(center);
  const double size = std::cbrt(volume_at(mover, u));
  ball.a = static_cast<float>(1 / (size * size));
  const auto v = static_cast<float>(u);
  ball.w = (1 - v) * mover.from_w + v * mover.to_w;
  const auto softer = static_cast<float>(1 - softness(plan) * 4 * std::max(u * (1 - u), 0.0));
  ball.a *= softer;
  ball.w *= softer;
  if (!mover.round) ball.shape = shape_at(mover, place.rotation, u, stretch_left(plan, u));
  return ball;
}

}  // namespace

void set_movers(MorphPlan& plan) {
  RigidParts parts;
  plan.graph.reset();
  if (plan.motion.path == Path::kParts) {
    parts = rigid_parts(plan);
    plan.graph = std::make_shared<const BallGraph>(plan, parts);
  } else {
    parts.alignments = {path_alignment(plan)};
    parts.part_of.assign(plan.pairs.size(), 0);
  }
  plan.parts = std::move(parts.alignments);
  const std::vector<float> order = starting_order(plan);
  const auto count = static_cast<double>(plan.pairs.size());
  std::vector<Mover> movers(plan.pairs.size());
  for (std::size_t e = 0; e < movers.size(); ++e) {
    const Pair& pair = plan.pairs[e];
    const Ball& p = plan.from[pair.from];
    const Ball& q = plan.to[pair.to];
    Mover& mover = movers[e];
    mover.part = parts.part_of[e];
    const Alignment& alignment = plan.parts[mover.part];
    const Mat3 back = transposed(alignment.rotation);
    mover.from = Vec3d(p.center) - alignment.from_center;
    mover.to = back * (Vec3d(q.center) - alignment.to_center) * (1 / alignment.scale);
    mover.from_volume = volume_of_ball(p);
    mover.to_volume = volume_of_ball(q);
    mover.from_w = strength(plan.kind, p.w, pair.from_share);
    mover.to_w = strength(plan.kind, q.w, pair.to_share);
    mover.round = is_round(p) && is_round(q);
    if (!mover.round) {
      mover.from_log = log_symmetric(to_mat3(p.shape));
      mover.to_log = back * log_symmetric(to_mat3(q.shape)) * alignment.rotation;
    }
    if (plan.motion.path == Path::kBezier)
      mover.bow = bow_of(plan, Vec3d(p.center), Vec3d(q.center));
    if (plan.motion.path == Path::kExplode) mover.launch = launch_of(plan, e, mover.from, mover.to);
    if (plan.motion.stagger != Stagger::kNone) mover.delay = order[e] * plan.motion.stagger_share;
    constexpr double kMost = 8;
    mover.inertia = static_cast<float>(std::pow(std::clamp(pair.mass * count, 1 / kMost, kMost),
                                                static_cast<double>(plan.motion.spring.lag)));
  }
  plan.movers = std::move(movers);
}

std::vector<Ball> balls_at(const MorphPlan& plan, float time) {
  PM_CHECK(plan.movers.size() == plan.pairs.size());
  std::vector<Ball> balls(plan.pairs.size());
  std::vector<double> progress(balls.size());
  const bool together = move_together(plan);
  const float common = ease(plan.motion, time);
  std::vector<Place> places;  // of the parts, where all balls are equally far
  for (const Alignment& part : plan.parts)
    places.push_back(place_at(part, static_cast<double>(common)));
  parallel_for(
      static_cast<std::int64_t>(balls.size()),
      [&](std::int64_t index) {
        const auto e = static_cast<std::size_t>(index);
        const Pair& pair = plan.pairs[e];
        const Mover& mover = plan.movers[e];
        const float u = together ? common : own_time(plan, e, time);
        progress[e] = static_cast<double>(u);
        // The ends' own numbers, not what powers and turns make of them in the last bits.
        if (time <= 0 || u == 0) {
          balls[e] = plan.from[pair.from];
          balls[e].w = mover.from_w;
        } else if (time >= 1 || u == 1) {
          balls[e] = plan.to[pair.to];
          balls[e].w = mover.to_w;
        } else {
          const auto v = static_cast<double>(u);
          balls[e] = between(
              plan, mover, together ? places[mover.part] : place_at(plan.parts[mover.part], v), v);
        }
      },
      256);
  if (plan.graph && time > 0 && time < 1) join(plan, progress, balls);
  for (std::size_t e = 0; e < balls.size(); ++e)
    balls[e].center = balls[e].center + to_float(plan.movers[e].drift * drifted(time));
  return balls;
}

void carry_on(MorphPlan& plan, const MorphPlan& before, float until, double pace) {
  PM_CHECK(plan.from.size() == before.pairs.size());
  constexpr float kStep = 1.0f / 128;
  const auto scale = 1 / static_cast<double>(kStep);
  const std::vector<Ball> earlier = balls_at(before, until - kStep),
                          later = balls_at(before, until + kStep);
  // Second order at the very beginning of the new motion.
  const std::vector<Ball> own[3] = {balls_at(plan, 0), balls_at(plan, kStep),
                                    balls_at(plan, 2 * kStep)};
  for (std::size_t e = 0; e < plan.movers.size(); ++e) {
    const std::uint32_t i = plan.pairs[e].from;
    const Vec3d had = (Vec3d(later[i].center) - Vec3d(earlier[i].center)) * (0.5 * scale * pace);
    const Vec3d has =
        (Vec3d(own[1][e].center) * 4 - Vec3d(own[0][e].center) * 3 - Vec3d(own[2][e].center)) *
        (0.5 * scale);
    plan.movers[e].drift = had - has;
  }
}

std::vector<PairFrame> pair_frames(const MorphPlan& plan, float time) {
  const bool together = move_together(plan);
  const float common = ease(plan.motion, time);
  std::vector<PairFrame> frames(plan.pairs.size());
  parallel_for(
      static_cast<std::int64_t>(frames.size()),
      [&](std::int64_t index) {
        const auto e = static_cast<std::size_t>(index);
        const Mover& mover = plan.movers[e];
        const auto u = static_cast<double>(together ? common : own_time(plan, e, time));
        const Alignment& alignment = plan.parts[mover.part];
        const Mat3 back = transposed(exp_rotation(alignment.turn * u));
        Mat3 from = back, to = back;
        if (!mover.round) {
          const Mat3 root =
              exp_symmetric(log_shape_at(mover, u, 0.5 * stretch_left(plan, u))) * back;
          from = exp_symmetric(log_shape_at(mover, 0, -0.5)) * root;
          to = exp_symmetric(log_shape_at(mover, 1, -0.5)) * root;
        }
        to = alignment.rotation * to;
        const double size = std::cbrt(volume_at(mover, u));
        const double from_size = std::cbrt(mover.from_volume) / size;
        const double to_size = std::cbrt(mover.to_volume) / size;
        for (double& v : from.m) v *= from_size;
        for (double& v : to.m) v *= to_size;
        frames[e] = {from, to};
      },
      256);
  return frames;
}

std::vector<float> pair_progress(const MorphPlan& plan, float time) {
  if (move_together(plan))
    return std::vector<float>(plan.pairs.size(), std::clamp(ease(plan.motion, time), 0.0f, 1.0f));
  std::vector<float> progress;
  for (std::size_t e = 0; e < plan.pairs.size(); ++e)
    progress.push_back(std::clamp(own_time(plan, e, time), 0.0f, 1.0f));
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
