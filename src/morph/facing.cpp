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

/// Least overlap of an object with its mirror image, and least rank of a second plane over the
/// first's.
constexpr double kMinOverlap = 0.7, kSecondPlane = 0.97;
/// The larger turn is taken only at less than this share of the smaller one's discrepancy.
constexpr double kGain = 0.98;
/// Angle up to which two turns are the same.
constexpr double kNear = 25 * exact::kPi / 180;
/// Weight of the distances within the bodies beside that of the places; of the mean distance.
constexpr double kDistances = 0.8, kCentrality = 0.5;
constexpr int kSteps = 20;

using Matrix = std::vector<double>;  // row by row

/// A body's sample about its centre, at a size of 1, with distances whose mean square is 1.
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
  const double size = 1 / std::sqrt(std::max(square, 1e-30)),
               unit = 1 / std::sqrt(std::max(distance_square, 1e-30));
  for (std::size_t i = 0; i < n; ++i) {
    body.points[i] = body.points[i] * size;
    double mean = 0;
    for (std::size_t k = 0; k < n; ++k) {
      body.distances.push_back(sample.distances[i][k] * unit);
      mean += sample.shares[k] * body.distances.back();
    }
    body.mean_distances.push_back(mean);
  }
  return body;
}

/// The row sums of squared distances, by share.
std::vector<double> square_means(const ScaledBody& body) {
  std::vector<double> sums(body.size(), 0);
  for (std::size_t i = 0; i < body.size(); ++i)
    for (std::size_t k = 0; k < body.size(); ++k) {
      const double d = body.distances[i * body.size() + k];
      sums[i] += body.shares[k] * d * d;
    }
  return sums;
}

/// The product C_a T C_b of a coupling with both bodies' distances.
Matrix carry_distances(const ScaledBody& a, const Matrix& coupling, const ScaledBody& b) {
  const std::size_t n = a.size(), m = b.size();
  Matrix half(n * m, 0), product(n * m, 0);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < m; ++k) {
      const double share = coupling[i * m + k];
      if (share == 0) continue;
      for (std::size_t l = 0; l < m; ++l) half[i * m + l] += share * b.distances[k * m + l];
    }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      const double d = a.distances[i * n + j];
      for (std::size_t l = 0; l < m; ++l) product[i * m + l] += d * half[j * m + l];
    }
  return product;
}

Matrix solve_linear(const ScaledBody& a, const ScaledBody& b, const Matrix& costs) {
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

/// The discrepancy of the bodies with `a` turned: conditional gradients (Frank and Wolfe 1956) with
/// exact steps, from the coupling that the places alone ask for.
double fused_discrepancy(const ScaledBody& a, const ScaledBody& b, double angle) {
  const std::size_t n = a.size(), m = b.size();
  const Mat3 rotation = about_vertical(angle);
  Matrix places(n * m), squares(n * m);
  const std::vector<double> a_squares = square_means(a), b_squares = square_means(b);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3d rotated = rotation * a.points[i];
    for (std::size_t k = 0; k < m; ++k) {
      const Vec3d offset = rotated - b.points[k];
      const double center = a.mean_distances[i] - b.mean_distances[k];
      places[i * m + k] = dot(offset, offset) + kCentrality * center * center;
      squares[i * m + k] = a_squares[i] + b_squares[k];
    }
  }
  Matrix coupling = solve_linear(a, b, places);
  Matrix carried = carry_distances(a, coupling, b);
  const auto value = [&] {
    double sum = 0;
    for (std::size_t i = 0; i < n * m; ++i)
      sum +=
          coupling[i] * ((1 - kDistances) * places[i] + kDistances * (squares[i] - 2 * carried[i]));
    return sum;
  };
  for (int step = 0; step < kSteps; ++step) {
    Matrix gradient(n * m);
    for (std::size_t i = 0; i < n * m; ++i)
      gradient[i] = (1 - kDistances) * places[i] + 2 * kDistances * (squares[i] - 2 * carried[i]);
    Matrix direction = solve_linear(a, b, gradient);
    for (std::size_t i = 0; i < n * m; ++i) direction[i] -= coupling[i];
    const double slope = sum_products(gradient, direction);
    if (slope > -1e-9) break;
    const Matrix change = carry_distances(a, direction, b);
    const double bend = -2 * kDistances * sum_products(change, direction);
    const double length = bend <= 0 ? 1 : std::min(1.0, -slope / (2 * bend));
    for (std::size_t i = 0; i < n * m; ++i) {
      coupling[i] += length * direction[i];
      carried[i] += length * change[i];
    }
  }
  return value();
}

double wrapped(double angle) { return exact::atan2(exact::sin(angle), exact::cos(angle)); }

}  // namespace

double turn_between(double from, double to) { return wrapped(to - from); }

bool is_symmetric(const Limbs& limbs) {
  constexpr double kSymmetric = 0.8;
  return !limbs.mirror_planes.empty() && limbs.mirror_planes[0].overlap >= kSymmetric;
}

std::optional<double> find_front_line(const Limbs& limbs) {
  const std::vector<MirrorPlane>& planes = limbs.mirror_planes;
  if (planes.empty() || planes[0].overlap < kMinOverlap) return std::nullopt;
  if (planes.size() > 1 && rank_plane(planes[1]) >= kSecondPlane * rank_plane(planes[0]))
    return std::nullopt;
  return planes[0].azimuth + exact::kPi / 2;
}

std::optional<double> find_facing(LimbPlan& limbs, double plan_angle,
                                  std::optional<double> from_front,
                                  std::optional<double> to_front) {
  if (from_front && to_front) return turn_between(*from_front, *to_front);
  const Limbs &from = limbs.from, &to = limbs.to;
  const auto a = from_front ? from_front : find_front_line(from),
             b = to_front ? to_front : find_front_line(to);
  if (!a || !b) return std::nullopt;
  // Either way round; the turn that is given already, where it is one of these.
  std::array<double, 2> angles = {wrapped(*b - *a), wrapped(*b - *a + exact::kPi)};
  for (double& angle : angles)
    if (std::fabs(wrapped(angle - plan_angle)) < kNear) angle = plan_angle;
  if (std::fabs(angles[1]) < std::fabs(angles[0])) std::swap(angles[0], angles[1]);
  std::array<LimbMatch, 2> matches;
  for (std::size_t k = 0; k < 2; ++k)
    // At the angle of the rotation by that angle, from which a plan asks for the same again.
    matches[k] = match_at(
        limbs, angles[k] == plan_angle ? plan_angle : log_rotation(about_vertical(angles[k])).y);
  if (is_certain(matches[0]) && is_certain(matches[1]))
    return angles[matches[1].cost < matches[0].cost ? 1 : 0];
  const ScaledBody body_a = scale_body(from.sample), body_b = scale_body(to.sample);
  std::array<double, 2> values;
  parallel_for(2, [&](std::int64_t k) {
    const auto at = static_cast<std::size_t>(k);
    values[at] = fused_discrepancy(body_a, body_b, angles[at]);
  });
  return angles[values[1] < kGain * values[0] ? 1 : 0];
}

}  // namespace polymorph
