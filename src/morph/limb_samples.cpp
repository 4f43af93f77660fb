#include "morph/limb_samples.h"

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "morph/align.h"
#include "morph/cost.h"
#include "morph/limbs.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// The least share of its length with which a lone limb is still stretched back to the whole.
constexpr double kMinLength = 0.02;
/// Least share of what a matched limb's length would be if it did not turn, and the most that a
/// limb is thicker than its counterpart.
constexpr double kMinTurned = 0.2, kMaxThicker = 4;

double station_at(std::size_t k) {
  return k == 0 ? 0 : k + 1 == LimbCurve::kPoints ? 1 : limb_station(k - 1);
}

/// A curve at a share of its length.
struct CurvePoint {
  Vec3d place;
  Vec3d slope;  ///< derivative by the share
  double radius = 0;
};

CurvePoint point_at(const LimbCurve& curve, double t) {
  constexpr std::size_t n = LimbCurve::kPoints;
  std::size_t k = 1;
  while (k + 1 < n && station_at(k) < t) ++k;
  const auto slope_of = [&](std::size_t segment) {
    return Vec3d(curve.points[segment] - curve.points[segment - 1]) *
           (1 / (station_at(segment) - station_at(segment - 1)));
  };
  const auto middle_of = [](std::size_t segment) {
    return (station_at(segment) + station_at(segment - 1)) / 2;
  };
  const double share =
      std::clamp((t - station_at(k - 1)) / (station_at(k) - station_at(k - 1)), 0.0, 1.0);
  CurvePoint point;
  point.place = Vec3d(curve.points[k - 1]) * (1 - share) + Vec3d(curve.points[k]) * share;
  point.radius = static_cast<double>(curve.radii[k - 1]) * (1 - share) +
                 static_cast<double>(curve.radii[k]) * share;
  // Linear between the segments' middles.
  const std::size_t next = t < middle_of(k) ? k : k + 1;
  if (next == 1 || next == n) {
    point.slope = slope_of(next == 1 ? 1 : n - 1);
  } else {
    const double between = (t - middle_of(next - 1)) / (middle_of(next) - middle_of(next - 1));
    point.slope = slope_of(next - 1) * (1 - between) + slope_of(next) * between;
  }
  return point;
}

/// Multiplies by `along` in a direction and by `across` perpendicular to it.
Mat3 stretch(Vec3d direction, double along, double across) {
  const Vec3d axis = normalized(direction);
  const double v[3] = {axis.x, axis.y, axis.z};
  Mat3 result;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      result.at(r, c) = result.at(r, c) * across + (along - across) * v[r] * v[c];
  return result;
}

/// Rotation and scaling of a pair's part, undone up to a moment, and of the whole motion.
struct PartMotion {
  Mat3 unturned, turn;
  double scale = 1, whole_scale = 1;
};
PartMotion part_motion(const PathPart& part, double u) {
  const PartPlace place = place_at(part, u);
  return {transposed(place.rotation), exp_rotation(part.turn), place.scale,
          exp_scalar(part.log_scale)};
}

/// A matched limb's slopes: its centre line is a mean of both objects', and so is its thickness.
void set_slopes(const CurvePoint& a, const CurvePoint& b, const PartMotion& part, double u,
                LimbSample& sample) {
  // In the source's frame and size.
  const Vec3d b_slope = transposed(part.turn) * b.slope * (1 / part.whole_scale);
  const double a_radius = a.radius,
               b_radius = std::clamp(b.radius / part.whole_scale, a.radius / kMaxThicker,
                                     a.radius * kMaxThicker);
  const Vec3d slope = a.slope * (1 - u) + b_slope * u;
  const double straight_length = length(a.slope) * (1 - u) + length(b_slope) * u;
  const double along = std::max(length(slope), kMinTurned * straight_length),
               radius = a_radius * (1 - u) + b_radius * u;
  sample.to_source =
      stretch(a.slope, length(a.slope) / (along * part.scale), a_radius / (radius * part.scale)) *
      rotation_between(slope, a.slope) * part.unturned;
  const double on = part.whole_scale / part.scale;
  sample.to_target = stretch(b.slope, length(b_slope) / along * on, b_radius / radius * on) *
                     rotation_between(part.turn * slope, b.slope) * part.turn * part.unturned;
}

/// A lone limb's slopes on its own object: as thick as there, but as long as it is now.
Mat3 lone_slope(Vec3d axis, double share, const Mat3& undone) {
  return stretch(axis, 1 / std::max(share, kMinLength), 1) * undone;
}

Mat3 scale_by(Mat3 a, double factor) {
  for (double& v : a.m) v *= factor;
  return a;
}

LimbSample lone_sample(const MorphPlan& plan, std::uint32_t e, double u,
                       const std::vector<Vec3>& roots) {
  const Pair& pair = plan.pairs[e];
  const bool is_source = plan.from_curves.lone_limbs[pair.from] != kNoLabel;
  const LimbCurves& curves = is_source ? plan.from_curves : plan.to_curves;
  const std::uint32_t ball = is_source ? pair.from : pair.to;
  const auto limb = static_cast<std::size_t>(curves.lone_limbs[ball]);
  const PartMotion part = part_motion(plan.paths->parts[plan.paths->balls[e].part], u);
  const CurvePoint at = point_at(curves.lone[limb], static_cast<double>(curves.stations[ball]));
  const double share = is_source ? 1 - u : u, gone = 1 - share;
  LimbSample sample;
  sample.pair = e;
  sample.is_lone = true;
  sample.mass = share;
  // It is its own object's nearly until nothing of it is left.
  const double other = gone * gone * gone;
  sample.progress = static_cast<float>(is_source ? other : 1 - other);
  const Vec3 own = to_float(at.place), counterpart = curves.counterparts[limb];
  sample.from = is_source ? own : counterpart;
  sample.to = is_source ? counterpart : own;
  const Mat3 nowhere = scale_by({}, 0);
  const Mat3 to_source = scale_by(part.unturned, 1 / part.scale),
             to_target = scale_by(part.turn * part.unturned, part.whole_scale / part.scale);
  sample.to_source = is_source ? lone_slope(at.slope, share, to_source) : nowhere;
  sample.to_target = is_source ? nowhere : lone_slope(at.slope, share, to_target);
  const Vec3d root(roots[is_source ? limb : plan.from_curves.lone.size() + limb]);
  const Vec3d offset = at.place - Vec3d(curves.lone[limb].points[0]);
  const Vec3d moved = transposed(part.unturned) * (is_source ? offset * part.scale
                                                             : transposed(part.turn) * offset *
                                                                   (part.scale / part.whole_scale));
  sample.center = share < 1 ? to_float(root + moved * share) : own;
  return sample;
}

/// The matched limb that both of a pair's balls belong to, or kNoLabel.
std::int32_t find_common_limb(const MorphPlan& plan, const Pair& pair) {
  const std::int32_t limb = plan.from_limbs[pair.from];
  return limb == plan.to_limbs[pair.to] ? limb : kNoLabel;
}

/// The share of the limb's length at which each pair of a matched limb is sampled: evenly, in the
/// order of the pairs' own shares, so that no stretch of a limb is without a sample.
std::vector<double> pair_stations(const MorphPlan& plan) {
  std::vector<double> own(plan.pairs.size(), 0), even(plan.pairs.size(), 0);
  std::vector<std::vector<std::uint32_t>> members(plan.from_curves.matched.size());
  for (std::uint32_t e = 0; e < plan.pairs.size(); ++e) {
    const Pair& pair = plan.pairs[e];
    const std::int32_t limb = find_common_limb(plan, pair);
    if (limb == kNoLabel) continue;
    own[e] = static_cast<double>(plan.from_curves.stations[pair.from]) +
             static_cast<double>(plan.to_curves.stations[pair.to]);
    members[static_cast<std::size_t>(limb)].push_back(e);
  }
  for (std::vector<std::uint32_t>& limb : members) {
    std::stable_sort(limb.begin(), limb.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return own[a] < own[b]; });
    for (std::size_t k = 0; k < limb.size(); ++k)
      even[limb[k]] = (static_cast<double>(k) + 0.5) / static_cast<double>(limb.size());
  }
  return even;
}

}  // namespace

std::vector<LimbSample> limb_samples(const MorphPlan& plan, float time,
                                     const std::vector<float>& eased, const BallSet& balls) {
  std::vector<LimbSample> samples;
  if (!has_curves(plan)) return samples;
  PM_CHECK(balls.size() == plan.pairs.size() && eased.size() == plan.pairs.size());
  const std::vector<Vec3> roots = moved_places(plan, plan.lone_roots, time, balls);
  const std::vector<double> stations = pair_stations(plan);
  std::vector<PlanLandmark> on_lines;
  std::vector<std::size_t> matched;
  for (std::uint32_t e = 0; e < plan.pairs.size(); ++e) {
    const Pair& pair = plan.pairs[e];
    const double u = std::clamp(static_cast<double>(eased[e]), 0.0, 1.0);
    if (is_lone(plan, pair)) {
      LimbSample sample = lone_sample(plan, e, u, roots);
      if (sample.mass > 0) samples.push_back(sample);
      continue;
    }
    const std::int32_t limb = find_common_limb(plan, pair);
    if (limb == kNoLabel) continue;
    const auto k = static_cast<std::size_t>(limb);
    const double t = stations[e];
    const CurvePoint a = point_at(plan.from_curves.matched[k], t),
                     b = point_at(plan.to_curves.matched[k], t);
    LimbSample sample;
    sample.pair = e;
    sample.from = to_float(a.place);
    sample.to = to_float(b.place);
    set_slopes(a, b, part_motion(plan.paths->parts[plan.paths->balls[e].part], u), u, sample);
    matched.push_back(samples.size());
    on_lines.push_back({sample.from, sample.to, e});
    samples.push_back(sample);
  }
  const std::vector<Vec3> places = moved_places(plan, on_lines, time, balls);
  for (std::size_t k = 0; k < matched.size(); ++k) {
    LimbSample& sample = samples[matched[k]];
    const float u = eased[sample.pair];
    sample.center = u <= 0 ? sample.from : u >= 1 ? sample.to : places[k];
  }
  return samples;
}

}  // namespace polymorph
