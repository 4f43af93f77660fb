#include "morph/limb_samples.h"

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "morph/align.h"
#include "morph/centre_line.h"
#include "morph/cost.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// Min remaining fraction of a lone limb's length in the slope of its map. The slope grows with the
/// inverse of that fraction.
constexpr double kMinLength = 0.02;
/// Min length of a matched limb's mean tangent, as a fraction of the tangents' mean length
/// (tangents in opposite directions cancel). Max ratio of matched limbs' radii.
constexpr double kMinTangent = 0.2, kMaxRadiusRatio = 4;

/// Point of a curve at a fraction of its length.
struct CurvePoint {
  Vec3d position;
  Vec3d tangent;  ///< derivative by that fraction
  double radius = 0;
};

CurvePoint point_at(const LimbCurve& curve, double t) {
  std::array<Vec3d, kLinePoints> points;
  std::array<double, kLinePoints> radii;
  for (std::size_t k = 0; k < kLinePoints; ++k) {
    points[k] = Vec3d(curve.points[k]);
    radii[k] = static_cast<double>(curve.radii[k]);
  }
  std::array<Vec3d, kLinePoints - 1> tangents;
  for (std::size_t k = 0; k < tangents.size(); ++k)
    tangents[k] = Vec3d(curve.points[k + 1] - curve.points[k]) *
                  (1 / (kLineStations[k + 1] - kLineStations[k]));
  return {interpolated(kLineStations, points, t), interpolated(tangents, t),
          interpolated(kLineStations, radii, t)};
}

/// The matrix that scales by `along` in `direction` and by `across` perpendicular to it.
Mat3 stretch(Vec3d direction, double along, double across) {
  const Vec3d axis = normalized(direction);
  const double v[3] = {axis.x, axis.y, axis.z};
  Mat3 result;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      result.at(r, c) = result.at(r, c) * across + (along - across) * v[r] * v[c];
  return result;
}

/// Sets the slopes of a sample on a matched limb (F_e in docs/method.md, Limbs in the map). The
/// moving limb's tangent and radius are interpolated at `u` between the points `a` and `b` of both
/// objects.
void set_slopes(const CurvePoint& a, const CurvePoint& b, const PartMotion& part, double u,
                LimbSample& sample) {
  // The target's tangent and radius, in the source's orientation and scale.
  const Vec3d b_tangent = transposed(part.total_rotation) * b.tangent * (1 / part.total_scale);
  const double a_radius = a.radius,
               b_radius = std::clamp(b.radius / part.total_scale, a.radius / kMaxRadiusRatio,
                                     a.radius * kMaxRadiusRatio);
  const Vec3d tangent = a.tangent * (1 - u) + b_tangent * u;
  const double mean_length = length(a.tangent) * (1 - u) + length(b_tangent) * u;
  const double moving_length = std::max(length(tangent), kMinTangent * mean_length),
               radius = a_radius * (1 - u) + b_radius * u;
  const double scale = part.pose.scale, target_scale = part.total_scale / scale;
  sample.to_source =
      stretch(a.tangent, length(a.tangent) / (moving_length * scale), a_radius / (radius * scale)) *
      rotation_between(tangent, a.tangent) * part.inv_rotation;
  sample.to_target = stretch(b.tangent, length(b_tangent) / moving_length * target_scale,
                             b_radius / radius * target_scale) *
                     rotation_between(part.total_rotation * tangent, b.tangent) *
                     part.total_rotation * part.inv_rotation;
}

/// Slope of a lone limb's map to its own object: it undoes the shrinking along `axis` to the
/// fraction `remaining`, and keeps the thickness. `inv_motion` inverts the part's rotation and
/// scaling.
Mat3 lone_slope(Vec3d axis, double remaining, const Mat3& inv_motion) {
  return stretch(axis, 1 / std::max(remaining, kMinLength), 1) * inv_motion;
}

/// Makes the sample of pair `e`, which is on a lone limb, at the pair's eased time `u`. `roots`:
/// the current positions of plan.lone_roots.
LimbSample lone_sample(const MorphPlan& plan, std::uint32_t e, double u,
                       const std::vector<Vec3>& roots) {
  const Pair& pair = plan.pairs[e];
  const bool is_source = plan.from_curves.lone_limbs[pair.from] != kNoLabel;
  const LimbCurves& curves = is_source ? plan.from_curves : plan.to_curves;
  const std::uint32_t ball = is_source ? pair.from : pair.to;
  const auto limb = static_cast<std::size_t>(curves.lone_limbs[ball]);
  const PartMotion part = part_motion(plan.paths->parts[plan.paths->balls[e].part], u);
  const double scale = part.pose.scale;
  const CurvePoint point = point_at(curves.lone[limb], static_cast<double>(curves.stations[ball]));
  // Fractions of the limb's length that remain and that are lost.
  const double remaining = is_source ? 1 - u : u, lost = 1 - remaining;
  LimbSample sample;
  sample.pair = e;
  sample.is_lone = true;
  sample.mass = remaining;
  // The weight of the other object is small until little of the limb is left.
  const double other_weight = lost * lost * lost;
  sample.progress = static_cast<float>(is_source ? other_weight : 1 - other_weight);
  // Positions on both objects. The other object's slope is 0: the whole limb is at one point there.
  const Vec3 own_point = to_float(point.position), counterpart = curves.counterparts[limb];
  sample.from = is_source ? own_point : counterpart;
  sample.to = is_source ? counterpart : own_point;
  const Mat3 inv_motion = is_source ? part.to_source() : part.to_target();
  sample.to_source = sample.to_target = Mat3{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  (is_source ? sample.to_source : sample.to_target) =
      lone_slope(point.tangent, remaining, inv_motion);
  // The moving point lies between the moving root and the point of the unshrunk limb. At the limb's
  // full length it is exactly `own_point`.
  const Vec3d root(roots[is_source ? limb : plan.from_curves.lone.size() + limb]);
  const Vec3d offset = point.position - Vec3d(curves.lone[limb].points[0]);
  const Vec3d moved_offset =
      transposed(part.inv_rotation) *
      (is_source ? offset * scale
                 : transposed(part.total_rotation) * offset * (scale / part.total_scale));
  sample.center = remaining < 1 ? to_float(root + moved_offset * remaining) : own_point;
  return sample;
}

/// The matched limb that both balls of a pair belong to, or kNoLabel.
std::int32_t find_common_limb(const MorphPlan& plan, const Pair& pair) {
  const std::int32_t limb = plan.from_limbs[pair.from];
  return limb == plan.to_limbs[pair.to] ? limb : kNoLabel;
}

/// Positions at which the pairs of matched limbs are sampled, as fractions of the limb's length.
/// They are equally spaced, in the order of the balls' own positions, so that a limb has no gaps
/// between samples.
std::vector<double> pair_stations(const MorphPlan& plan) {
  std::vector<double> ball_stations(plan.pairs.size(), 0), stations(plan.pairs.size(), 0);
  std::vector<std::vector<std::uint32_t>> members(plan.from_curves.matched.size());
  for (std::uint32_t e = 0; e < plan.pairs.size(); ++e) {
    const Pair& pair = plan.pairs[e];
    const std::int32_t limb = find_common_limb(plan, pair);
    if (limb == kNoLabel) continue;
    // The sum of both balls' stations; only the order matters.
    ball_stations[e] = static_cast<double>(plan.from_curves.stations[pair.from]) +
                       static_cast<double>(plan.to_curves.stations[pair.to]);
    members[static_cast<std::size_t>(limb)].push_back(e);
  }
  for (std::vector<std::uint32_t>& limb_pairs : members) {
    std::stable_sort(limb_pairs.begin(), limb_pairs.end(), [&](std::uint32_t a, std::uint32_t b) {
      return ball_stations[a] < ball_stations[b];
    });
    for (std::size_t k = 0; k < limb_pairs.size(); ++k)
      stations[limb_pairs[k]] =
          (static_cast<double>(k) + 0.5) / static_cast<double>(limb_pairs.size());
  }
  return stations;
}

}  // namespace

std::vector<LimbSample> limb_samples(const MorphPlan& plan, float time,
                                     const std::vector<float>& eased, const BallSet& balls) {
  std::vector<LimbSample> samples;
  if (!has_curves(plan)) return samples;
  PM_CHECK(balls.size() == plan.pairs.size() && eased.size() == plan.pairs.size());
  const std::vector<Vec3> roots = move_points(plan, plan.lone_roots, time, balls);
  const std::vector<double> stations = pair_stations(plan);
  // Samples of matched limbs move as landmarks do: their positions are computed at the end,
  // together.
  std::vector<PlanLandmark> line_points;
  std::vector<std::size_t> matched_samples;
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
    sample.from = to_float(a.position);
    sample.to = to_float(b.position);
    set_slopes(a, b, part_motion(plan.paths->parts[plan.paths->balls[e].part], u), u, sample);
    matched_samples.push_back(samples.size());
    line_points.push_back({sample.from, sample.to, e});
    samples.push_back(sample);
  }
  const std::vector<Vec3> positions = move_points(plan, line_points, time, balls);
  for (std::size_t k = 0; k < matched_samples.size(); ++k) {
    LimbSample& sample = samples[matched_samples[k]];
    const float u = eased[sample.pair];
    sample.center = u <= 0 ? sample.from : u >= 1 ? sample.to : positions[k];
  }
  return samples;
}

}  // namespace polymorph
