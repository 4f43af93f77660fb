#include "morph/facing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/exact_math.h"
#include "base/parallel.h"
#include "morph/align.h"
#include "morph/transport.h"

namespace polymorph {
namespace {

/// Min MirrorPlane::overlap of the plane that decides the front. The front is undecided if the
/// second plane's score_plane() is at least kMaxSecondScore times the first plane's.
constexpr double kMinOverlap = 0.7, kMaxSecondScore = 0.97;
/// The larger of two rotations is taken only if its discrepancy is below this fraction of the
/// smaller rotation's or, where the limbs match for certain at both, if its discrepancy times the
/// cost of its match is.
constexpr double kMaxDiscrepancyRatio = 0.9, kMaxCertainRatio = 0.95;
/// A rotation that differs by less than this angle, in radians, from the plan's is replaced by it.
constexpr double kMaxPlanDifference = 25 * exact::kPi / 180;
/// Weights of the discrepancy (docs/method.md, Facing): kGeodesicWeight for the term in geodesic
/// distances, 1 - kGeodesicWeight for the term in points. Within the term in points,
/// kCentralityWeight is the weight of the points' mean distances.
constexpr double kGeodesicWeight = 0.8, kCentralityWeight = 0.5;
constexpr int kMaxGradientSteps = 20;  // max number of steps of conditional gradients

using Matrix = std::vector<double>;  // row by row

/// A body's sample with its centroid at the origin, an RMS radius of 1, and geodesic distances
/// whose mean square is 1.
struct ScaledBody {
  std::vector<Vec3d> points;
  std::vector<double> shares, mean_distances;
  Matrix distances;
  std::size_t size() const { return points.size(); }
};

ScaledBody scale_body(const BodySample& sample) {
  ScaledBody body;
  body.shares = sample.shares;
  Vec3d center;
  const std::size_t n = sample.points.size();
  for (std::size_t i = 0; i < n; ++i) center = center + sample.points[i] * sample.shares[i];
  double square = 0, distance_square = 0;
  for (std::size_t i = 0; i < n; ++i) {
    body.points.push_back(sample.points[i] - center);
    square += sample.shares[i] * dot(body.points[i], body.points[i]);
    for (std::size_t k = 0; k < n; ++k)
      distance_square +=
          sample.shares[i] * sample.shares[k] * sample.distances[i][k] * sample.distances[i][k];
  }
  // 1e-30 prevents a division by 0.
  const double scale = 1 / std::sqrt(std::max(square, 1e-30)),
               distance_scale = 1 / std::sqrt(std::max(distance_square, 1e-30));
  for (std::size_t i = 0; i < n; ++i) {
    body.points[i] = body.points[i] * scale;
    double mean = 0;
    for (std::size_t k = 0; k < n; ++k) {
      body.distances.push_back(sample.distances[i][k] * distance_scale);
      mean += sample.shares[k] * body.distances.back();
    }
    body.mean_distances.push_back(mean);
  }
  return body;
}

/// Mean squared distance of each point to all points, weighted by share.
std::vector<double> mean_squared_distances(const ScaledBody& body) {
  std::vector<double> sums(body.size(), 0);
  for (std::size_t i = 0; i < body.size(); ++i)
    for (std::size_t k = 0; k < body.size(); ++k) {
      const double d = body.distances[i * body.size() + k];
      sums[i] += body.shares[k] * d * d;
    }
  return sums;
}

/// The product C_a T C_b, where C_a and C_b are the bodies' distance matrices and T couples them.
Matrix multiply_distances(const ScaledBody& a, const Matrix& coupling, const ScaledBody& b) {
  const std::size_t n = a.size(), m = b.size();
  Matrix coupling_times_b(n * m, 0), product(n * m, 0);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < m; ++k) {
      const double amount = coupling[i * m + k];
      if (amount == 0) continue;
      for (std::size_t l = 0; l < m; ++l)
        coupling_times_b[i * m + l] += amount * b.distances[k * m + l];
    }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      const double d = a.distances[i * n + j];
      for (std::size_t l = 0; l < m; ++l) product[i * m + l] += d * coupling_times_b[j * m + l];
    }
  return product;
}

/// The coupling with the least sum of costs * coupling (optimal transport).
Matrix solve_linear(const ScaledBody& a, const ScaledBody& b, const Matrix& costs) {
  // solve_transport() needs costs >= 0; a constant does not change the optimal coupling.
  const double minimum = *std::min_element(costs.begin(), costs.end());
  const TransportPlan plan =
      solve_transport(a.shares, b.shares, [&](std::uint32_t from, std::span<float> row) {
        for (std::size_t k = 0; k < row.size(); ++k)
          row[k] = static_cast<float>(costs[from * b.size() + k] - minimum);
      });
  Matrix coupling(a.size() * b.size(), 0);
  for (const TransportFlow& flow : plan.flows)
    coupling[flow.from * b.size() + flow.to] = flow.amount;
  return coupling;
}

double sum_products(const Matrix& a, const Matrix& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// The fused Gromov-Wasserstein discrepancy of the bodies, with `a` rotated by `angle` radians
/// about the vertical. It is minimized by conditional gradients (Frank and Wolfe 1956) with exact
/// line search, starting from the optimal transport of the term in points.
double fused_discrepancy(const ScaledBody& a, const ScaledBody& b, double angle) {
  const std::size_t n = a.size(), m = b.size();
  const Mat3 rotation = about_vertical(angle);
  // The loss (d_a - d_b)^2 is split into d_a^2 + d_b^2, whose mean does not depend on the coupling,
  // and -2 d_a d_b, which multiply_distances() sums.
  Matrix point_costs(n * m), squared_distances(n * m);
  const std::vector<double> a_means = mean_squared_distances(a),
                            b_means = mean_squared_distances(b);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3d rotated = rotation * a.points[i];
    for (std::size_t k = 0; k < m; ++k) {
      const Vec3d offset = rotated - b.points[k];
      const double mean_difference = a.mean_distances[i] - b.mean_distances[k];
      point_costs[i * m + k] =
          dot(offset, offset) + kCentralityWeight * mean_difference * mean_difference;
      squared_distances[i * m + k] = a_means[i] + b_means[k];
    }
  }
  // Start: the optimal transport of the term in points.
  Matrix coupling = solve_linear(a, b, point_costs);
  Matrix product = multiply_distances(a, coupling, b);
  const auto discrepancy = [&] {
    double sum = 0;
    for (std::size_t i = 0; i < n * m; ++i)
      sum += coupling[i] * ((1 - kGeodesicWeight) * point_costs[i] +
                            kGeodesicWeight * (squared_distances[i] - 2 * product[i]));
    return sum;
  };
  // At a step s along `direction` the discrepancy changes by slope s + curvature s^2. Each step
  // goes to the minimum of this parabola, but not beyond s = 1.
  for (int step = 0; step < kMaxGradientSteps; ++step) {
    // The product is quadratic in the coupling, hence the factor 2. The sum of squared_distances
    // is the same for all couplings, so their factor does not matter.
    Matrix gradient(n * m);
    for (std::size_t i = 0; i < n * m; ++i)
      gradient[i] = (1 - kGeodesicWeight) * point_costs[i] +
                    2 * kGeodesicWeight * (squared_distances[i] - 2 * product[i]);
    Matrix direction = solve_linear(a, b, gradient);
    for (std::size_t i = 0; i < n * m; ++i) direction[i] -= coupling[i];
    const double slope = sum_products(gradient, direction);
    if (slope > -1e-9) break;  // converged
    const Matrix product_change = multiply_distances(a, direction, b);
    const double curvature = -2 * kGeodesicWeight * sum_products(product_change, direction);
    const double step_length = curvature <= 0 ? 1 : std::min(1.0, -slope / (2 * curvature));
    for (std::size_t i = 0; i < n * m; ++i) {
      coupling[i] += step_length * direction[i];
      product[i] += step_length * product_change[i];
    }
  }
  return discrepancy();
}

double wrap_angle(double angle) { return exact::atan2(exact::sin(angle), exact::cos(angle)); }

}  // namespace

double azimuth_difference(double from, double to) { return wrap_angle(to - from); }

bool is_symmetric(const Limbs& limbs) {
  constexpr double kSymmetric = 0.8;
  return !limbs.mirror_planes.empty() && limbs.mirror_planes[0].overlap >= kSymmetric;
}

std::optional<double> find_front_axis(const Limbs& limbs) {
  const std::vector<MirrorPlane>& planes = limbs.mirror_planes;
  if (planes.empty() || planes[0].overlap < kMinOverlap) return std::nullopt;
  if (planes.size() > 1 && score_plane(planes[1]) >= kMaxSecondScore * score_plane(planes[0]))
    return std::nullopt;
  return planes[0].azimuth + exact::kPi / 2;
}

std::optional<double> find_facing(LimbPlan& limbs, double plan_angle,
                                  std::optional<double> from_front,
                                  std::optional<double> to_front) {
  if (from_front && to_front) return azimuth_difference(*from_front, *to_front);
  const Limbs &from = limbs.from, &to = limbs.to;
  const auto from_azimuth = from_front ? from_front : find_front_axis(from),
             to_azimuth = to_front ? to_front : find_front_axis(to);
  if (!from_azimuth || !to_azimuth) return std::nullopt;
  // The two rotations that take one plane to the other, the smaller first. The plan's angle
  // replaces an angle that is near it.
  std::array<double, 2> angles = {wrap_angle(*to_azimuth - *from_azimuth),
                                  wrap_angle(*to_azimuth - *from_azimuth + exact::kPi)};
  for (double& angle : angles)
    if (std::fabs(wrap_angle(angle - plan_angle)) < kMaxPlanDifference) angle = plan_angle;
  if (std::fabs(angles[1]) < std::fabs(angles[0])) std::swap(angles[0], angles[1]);
  std::array<LimbMatch, 2> matches;
  for (std::size_t k = 0; k < 2; ++k)
    // match_at() stores one match per exact angle. plan_morph() later calls it with
    // log_rotation() of the chosen rotation, so the angle is rounded in the same way here.
    matches[k] = match_at(
        limbs, angles[k] == plan_angle ? plan_angle : log_rotation(about_vertical(angles[k])).y);
  const bool are_certain = is_certain(matches[0]) && is_certain(matches[1]);
  // The discrepancy does not know the user's choices.
  if (are_certain && (matches[0].is_chosen || matches[1].is_chosen))
    return angles[matches[1].cost < matches[0].cost ? 1 : 0];
  const ScaledBody body_a = scale_body(from.sample), body_b = scale_body(to.sample);
  std::array<double, 2> discrepancies;
  parallel_for(2, [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    discrepancies[i] = fused_discrepancy(body_a, body_b, angles[i]);
  });
  double max_ratio = kMaxDiscrepancyRatio;
  if (are_certain) {
    for (std::size_t k = 0; k < 2; ++k) discrepancies[k] *= matches[k].cost;
    max_ratio = kMaxCertainRatio;
  }
  return angles[discrepancies[1] < max_ratio * discrepancies[0] ? 1 : 0];
}

}  // namespace polymorph
