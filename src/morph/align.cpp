#include "morph/align.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/exact_math.h"
#include "base/parallel.h"

namespace polymorph {
namespace {

/// Number of representatives of each object in the search for a rotation.
constexpr std::size_t kRepresentatives = 80;
/// Max cost of a rotation that tips an object over, as a fraction of the best upright rotation's.
constexpr double kMaxTipCost = 0.6;

/// The rotations of a cube: signed permutations of the axes, without reflections; the identity
/// first.
std::vector<Mat3> cube_rotations() {
  std::vector<Mat3> rotations;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 rotation{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
      for (int row = 0; row < 3; ++row)
        rotation.at(row, order[static_cast<std::size_t>(row)]) = (signs >> row) & 1 ? -1 : 1;
      const auto& m = rotation.m;
      const double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) -
                                 m[1] * (m[3] * m[8] - m[5] * m[6]) +
                                 m[2] * (m[3] * m[7] - m[4] * m[6]);
      if (determinant > 0) rotations.push_back(rotation);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return rotations;
}

/// Solves the transport problem between two sides. The plan's cost excludes the distances to
/// landmarks.
TransportPlan plan_between(const CostSide& a, const CostSide& b, float label_cost) {
  TransportPlan plan = solve_transport(
      a.mass, b.mass,
      [&](std::uint32_t from, std::span<float> costs) { cost_row(a, b, label_cost, from, costs); });
  for (std::size_t axis = a.first_pinned_axis; axis < a.values.size(); ++axis)
    for (const TransportFlow& flow : plan.flows) {
      const double difference = static_cast<double>(a.values[axis][flow.from]) -
                                static_cast<double>(b.values[axis][flow.to]);
      plan.cost -= flow.amount * difference * difference;
    }
  return plan;
}

/// A rotation, and the cost of the best plan with it.
struct RotationFit {
  Mat3 rotation;
  double cost = 0;
};

/// Alternates between transport plan and Procrustes fit, starting with `rotation`, until the cost
/// stops falling.
RotationFit refine_rotation(const CostSide& a, const CostSide& b, float label_cost, Mat3 rotation,
                            RotationAxis axis) {
  constexpr int kMaxSteps = 12;
  constexpr double kMinGain = 1e-3;  // relative fall of the cost in a step
  RotationFit best;
  for (int step = 0; step < kMaxSteps; ++step) {
    const TransportPlan plan = plan_between(rotate_side(a, rotation), b, label_cost);
    if (step > 0 && !(plan.cost < (1 - kMinGain) * best.cost)) break;
    best = {rotation, plan.cost};
    rotation = fit_rotation(a, b, plan.flows, axis);
  }
  return best;
}

/// Refines each of `starts`.
std::vector<RotationFit> refine_rotations(const CostSide& a, const CostSide& b, float label_cost,
                                          const std::vector<Mat3>& starts, RotationAxis axis) {
  std::vector<RotationFit> fits(starts.size());
  parallel_for(static_cast<std::int64_t>(starts.size()), [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    fits[k] = refine_rotation(a, b, label_cost, starts[k], axis);
  });
  return fits;
}

/// Chooses the fit with the smallest rotation among those whose cost is nearly the lowest: above it
/// by at most 1 % of its gain over `unrotated_cost`.
RotationFit choose_fit(const std::vector<RotationFit>& fits, double unrotated_cost) {
  double lowest = fits[0].cost;
  for (const RotationFit& fit : fits) lowest = std::min(lowest, fit.cost);
  const double max_cost = lowest + 0.01 * std::max(unrotated_cost - lowest, 0.0);
  const RotationFit* chosen = nullptr;
  for (const RotationFit& fit : fits)
    if (fit.cost <= max_cost &&
        (!chosen || rotation_angle(fit.rotation) < rotation_angle(chosen->rotation) - 1e-6))
      chosen = &fit;
  return *chosen;
}

/// Refits `rotation` about any axis, with all balls. Returns the mean squared distance that is left
/// between paired balls, as a fraction of the squared RMS size.
double residual(const CostSide& a, const CostSide& b, float label_cost, const Mat3& rotation) {
  const TransportPlan plan = plan_between(rotate_side(a, rotation), b, label_cost);
  const CostSide fitted = rotate_side(a, fit_rotation(a, b, plan.flows, RotationAxis::kAny));
  double sum = 0;
  for (const TransportFlow& flow : plan_between(fitted, b, label_cost).flows)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double difference = static_cast<double>(fitted.values[axis][flow.from]) -
                                static_cast<double>(b.values[axis][flow.to]);
      sum += flow.amount * difference * difference;
    }
  return sum;
}

}  // namespace

Mat3 rotation_between(Vec3d from, Vec3d to) {
  const Vec3d a = normalized(from), b = normalized(to);
  if (dot(a, a) == 0 || dot(b, b) == 0) return {};
  const double cosine = dot(a, b);
  // Near 180 degrees the axis is undetermined: any perpendicular one serves.
  if (cosine < -0.999) {
    const Vec3d axis = normalized(cross(a, std::fabs(a.x) < 0.9 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    const double v[3] = {axis.x, axis.y, axis.z};
    Mat3 half_turn;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) half_turn.at(r, c) = 2 * v[r] * v[c] - (r == c ? 1 : 0);
    return half_turn;
  }
  // Rodrigues' formula: I + K + K^2 / (1 + cosine), where K w = v x w. `result` starts as I.
  const Vec3d v = cross(a, b);
  const Mat3 k{{0, -v.z, v.y, v.z, 0, -v.x, -v.y, v.x, 0}};
  const Mat3 square = k * k;
  Mat3 result;
  for (std::size_t i = 0; i < 9; ++i) result.m[i] += k.m[i] + square.m[i] / (1 + cosine);
  return result;
}

Mat3 about_vertical(double angle) {
  const double c = exact::cos(angle), s = exact::sin(angle);
  return Mat3{{c, 0, s, 0, 1, 0, -s, 0, c}};
}

Mat3 fit_rotation(const CostSide& a, const CostSide& b, std::span<const TransportFlow> flows,
                  RotationAxis axis) {
  Mat3 sum{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  // Positions (first = 0) and outward directions (first = 3) both rotate with the object.
  for (std::size_t first = 0; first < CostSide::kRotatingAxes; first += 3)
    for (const TransportFlow& flow : flows)
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
          sum.at(r, c) +=
              flow.amount *
              static_cast<double>(b.values[first + static_cast<std::size_t>(r)][flow.to]) *
              static_cast<double>(a.values[first + static_cast<std::size_t>(c)][flow.from]);
  if (axis == RotationAxis::kAny) return nearest_rotation(sum);
  // Of the rotations R about y, this one has the largest trace of R^T sum.
  const double sine = sum.at(0, 2) - sum.at(2, 0), cosine = sum.at(0, 0) + sum.at(2, 2);
  return about_vertical(exact::atan2(sine, cosine));
}

std::optional<Mat3> fit_landmark_rotation(std::span<const Vec3> from, std::span<const Vec3> to) {
  // Min length of the vector (cosine, sine), as a fraction of the sum of |p| |q| over the
  // horizontal offsets. The fraction is 1 if one rotation takes every p to the direction of its q.
  constexpr double kMinAgreement = 0.3;
  // Min RMS distance of the points from the vertical line through their centroid, as a fraction of
  // their RMS distance from the centroid.
  constexpr double kMinHorizontal = 0.1;
  if (from.size() < 3) return std::nullopt;
  const auto center = [](std::span<const Vec3> points) {
    Vec3d sum;
    for (const Vec3 p : points) sum = sum + Vec3d(p);
    return sum * (1 / static_cast<double>(points.size()));
  };
  const Vec3d from_center = center(from), to_center = center(to);
  double sine = 0, cosine = 0, horizontal = 0, from_horizontal_square = 0, to_horizontal_square = 0,
         from_square = 0, to_square = 0;
  for (std::size_t l = 0; l < from.size(); ++l) {
    const Vec3d p = Vec3d(from[l]) - from_center, q = Vec3d(to[l]) - to_center;
    const double p2 = p.x * p.x + p.z * p.z, q2 = q.x * q.x + q.z * q.z;
    sine += q.x * p.z - q.z * p.x;
    cosine += q.x * p.x + q.z * p.z;
    horizontal += std::sqrt(p2 * q2);
    from_horizontal_square += p2, to_horizontal_square += q2;
    from_square += dot(p, p), to_square += dot(q, q);
  }
  const bool is_spread_out =
      from_horizontal_square > kMinHorizontal * kMinHorizontal * from_square &&
      to_horizontal_square > kMinHorizontal * kMinHorizontal * to_square && horizontal > 0;
  if (!is_spread_out || std::sqrt(sine * sine + cosine * cosine) < kMinAgreement * horizontal)
    return std::nullopt;
  return about_vertical(exact::atan2(sine, cosine));
}

RotationResult find_rotation(const CostSide& a, const CostSide& b, float label_cost, double gain,
                             double tip_residual) {
  // Search on representatives: first about the vertical, then about any axis.
  const CostSide coarse_a = coarsen_side(a, kRepresentatives),
                 coarse_b = coarsen_side(b, kRepresentatives);
  const double unrotated_cost = plan_between(coarse_a, coarse_b, label_cost).cost;
  constexpr int kUprightStarts = 8;  // one every 45 degrees
  std::vector<Mat3> upright;
  for (int i = 0; i < kUprightStarts; ++i)
    upright.push_back(i == 0 ? Mat3{} : about_vertical(2 * exact::kPi * i / kUprightStarts));
  RotationFit vertical =
      choose_fit(refine_rotations(coarse_a, coarse_b, label_cost, upright, RotationAxis::kVertical),
                 unrotated_cost);
  if (!(vertical.cost < (1 - gain) * unrotated_cost)) vertical = {Mat3{}, unrotated_cost};
  const RotationFit any_axis = choose_fit(
      refine_rotations(coarse_a, coarse_b, label_cost, cube_rotations(), RotationAxis::kAny),
      unrotated_cost);
  // An object is tipped over only if that is much cheaper and, with all balls, leaves no larger
  // residual than near copies do.
  const bool is_cheaper =
      any_axis.cost < (1 - gain) * unrotated_cost && any_axis.cost < kMaxTipCost * vertical.cost;
  if (is_cheaper && residual(a, b, label_cost, any_axis.rotation) <= tip_residual)
    return {any_axis.rotation, RotationAxis::kAny};
  return {vertical.rotation, RotationAxis::kVertical};
}

}  // namespace polymorph
