#include "spheres/fit_field.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "base/exact_math.h"
#include "base/parallel.h"

namespace polymorph {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kGroupSize = 32;  // points that use a common list of balls

/// Balls that may matter at the points of a group (whose contribution may exceed e^-9 times the
/// largest), as a structure of arrays. One object is reused for many groups, so that it keeps its
/// memory.
class GroupBalls {
 public:
  std::vector<std::uint32_t> indices;  ///< indices of the balls, ascending

  /// Bounds each ball's contribution on the sphere around the points: there, |u| differs from its
  /// value at the centre by at most `norms` times the radius. `norms`: compute_norms(all).
  void collect(const std::vector<FitBall>& all, const std::vector<double>& norms,
               const FitPoint* points, std::size_t count) {
    constexpr double kNegligible = 9;
    Vector3d low = points[0].point, high = low;
    for (std::size_t i = 1; i < count; ++i) {
      low = low.cwiseMin(points[i].point);
      high = high.cwiseMax(points[i].point);
    }
    const Vector3d middle = (low + high) / 2;
    const double radius = (high - low).norm() / 2;
    upper_bounds_.resize(all.size());
    double max_lower_bound = -1e300;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double distance = (all[i].root * (middle - all[i].center)).norm();
      const double extent = norms[i] * radius;
      const double near = std::max(0.0, distance - extent), far = distance + extent;
      upper_bounds_[i] = all[i].w - near * near;
      max_lower_bound = std::max(max_lower_bound, all[i].w - far * far);
    }
    indices.clear();
    for (std::size_t i = 0; i < all.size(); ++i)
      if (upper_bounds_[i] > max_lower_bound - kNegligible)
        indices.push_back(static_cast<std::uint32_t>(i));
    data_.resize(13 * indices.size());
    for (std::size_t k = 0; k < indices.size(); ++k) {
      const FitBall& ball = all[indices[k]];
      double* at = data_.data() + k;
      const auto put = [&](double value) {
        *at = value;
        at += indices.size();
      };
      for (int r = 0; r < 3; ++r) put(ball.center[r]);
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) put(ball.root(r, c));
      put(ball.w);
    }
  }
  std::size_t size() const { return indices.size(); }
  const double* center(std::size_t axis) const { return row(axis); }
  const double* root(std::size_t r, std::size_t c) const { return row(3 + 3 * r + c); }
  const double* w() const { return row(12); }

 private:
  const double* row(std::size_t i) const { return data_.data() + i * indices.size(); }
  /// 13 rows (centre, root, w); and, per ball of the fit, a bound of the contribution's logarithm.
  std::vector<double> data_, upper_bounds_;
};

/// A point's residual and loss.
struct Loss {
  double distance = 0;  ///< psi / steepness - target
  double weight = 0;    ///< weight of its square, including Huber's loss (reweighted least squares)
  double cost = 0;      ///< Huber's loss
};

Loss compute_loss(const FitPoint& point, double psi, double steepness, double length) {
  Loss loss;
  loss.distance = psi / steepness - point.target;
  double weight = point.weight;
  switch (point.rule) {
    case FitPoint::Rule::kSurface:
      break;
    case FitPoint::Rule::kInside:
      if (loss.distance > 0) weight = 0;
      break;
    case FitPoint::Rule::kOutside:
      if (loss.distance < 0) weight = 0;
      break;
    case FitPoint::Rule::kOffset:
      // A field steeper than a distance is harmless; a flatter one means that a second sheet is
      // near.
      if (loss.distance * point.target > 0) weight *= 0.2;
      break;
  }
  const double huber = 0.01 * length, size = std::abs(loss.distance);
  loss.cost = weight * (size <= huber ? size * size : huber * (2 * size - huber));
  loss.weight = weight * (size <= huber ? 1 : huber / size);
  return loss;
}

/// Computes the Frobenius norms of the balls' roots.
std::vector<double> compute_norms(const std::vector<FitBall>& balls) {
  std::vector<double> norms;
  for (const FitBall& ball : balls) norms.push_back(ball.root.norm());
  return norms;
}

/// Values at a point per ball of a group: u = root (x - center), and q, the ball's fraction of the
/// field. Reused like GroupBalls.
class Terms {
 public:
  void resize(std::size_t balls) {
    size_ = balls;
    data_.resize(5 * balls);
  }
  std::size_t size() const { return size_; }
  double* u(std::size_t axis) { return data_.data() + axis * size_; }
  double* q() { return u(3); }
  double* scratch() { return u(4); }  ///< temporary values for sums

 private:
  std::size_t size_ = 0;
  std::vector<double> data_;
};
struct Term {
  double q = 0;
  Vector3d u, slope;  // slope = root^T u
};

/// Calls f(group, points, count, balls, terms) for all groups from `first` on, in parallel.
template <class F>
void for_each_group(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                    std::size_t first, const F& f) {
  const std::vector<double> norms = compute_norms(balls);
  const std::size_t groups = (points.size() + kGroupSize - 1) / kGroupSize;
  parallel_ranges(
      static_cast<std::int64_t>(groups - first), 8, [&](std::int64_t begin, std::int64_t end) {
        GroupBalls near;
        Terms terms;
        for (std::int64_t k = begin; k < end; ++k) {
          const std::size_t g = first + static_cast<std::size_t>(k);
          const FitPoint* at = points.data() + g * kGroupSize;
          const std::size_t count = std::min(kGroupSize, points.size() - g * kGroupSize);
          near.collect(balls, norms, at, count);
          terms.resize(near.size());
          f(g, at, count, near, terms);
        }
      });
}

/// The entries of one group's rows.
struct GroupRows {
  std::vector<std::uint32_t> balls;
  std::vector<float> weights, derivatives;
};

/// Replaces each x <= 0 by e^x = 2^n e^r with x = n ln 2 + r; values below -50 count as -50. Adding
/// 1.5 * 2^52 rounds x / ln 2 to n and puts n into the low bits, which a shift moves to the
/// exponent; p is the Taylor polynomial of e^r. Written without branches for vectorization; the
/// result has the same bits for any vector width (base/exact_math.h).
void exponentiate(double* x, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const double a = x[i] > -50.0 ? x[i] : -50.0;
    const double shifted = a * (1 / exact::kLn2) + 0x1.8p52, n = shifted - 0x1.8p52;
    const double r = (a - n * 0x1.62e42feep-1) - n * 0x1.a39ef35793c76p-33;
    double p = 1.0 / 479001600;
    p = p * r + 1.0 / 39916800;
    p = p * r + 1.0 / 3628800;
    p = p * r + 1.0 / 362880;
    p = p * r + 1.0 / 40320;
    p = p * r + 1.0 / 5040;
    p = p * r + 1.0 / 720;
    p = p * r + 1.0 / 120;
    p = p * r + 1.0 / 24;
    p = p * r + 1.0 / 6;
    p = p * r + 0.5;
    p = p * r + 1;
    p = p * r + 1;
    x[i] = std::bit_cast<double>(std::bit_cast<std::uint64_t>(p) +
                                 (std::bit_cast<std::uint64_t>(shifted) << 52));
  }
}

/// Adds the values in four partial sums, so that the result does not depend on the vector width.
double sum_in_lanes(const double* x, std::size_t count) {
  double sums[4] = {0, 0, 0, 0};
  std::size_t i = 0;
  for (; i + 4 <= count; i += 4)
    for (std::size_t k = 0; k < 4; ++k) sums[k] += x[i + k];
  for (std::size_t k = 0; i < count; ++i, ++k) sums[k] += x[i];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

double max_in_lanes(const double* x, std::size_t count) {
  double tops[4] = {x[0], x[0], x[0], x[0]};
  std::size_t i = 0;
  for (; i + 4 <= count; i += 4)
    for (std::size_t k = 0; k < 4; ++k) tops[k] = x[i + k] > tops[k] ? x[i + k] : tops[k];
  for (; i < count; ++i) tops[0] = std::max(tops[0], x[i]);
  return std::max(std::max(tops[0], tops[1]), std::max(tops[2], tops[3]));
}

/// Computes one component of u = root (at - center) for all balls.
void compute_u_component(const Vector3d& at, const GroupBalls& balls, std::size_t axis,
                         double* __restrict u) {
  const double *c0 = balls.center(0), *c1 = balls.center(1), *c2 = balls.center(2);
  const double *r0 = balls.root(axis, 0), *r1 = balls.root(axis, 1), *r2 = balls.root(axis, 2);
  const double x = at[0], y = at[1], z = at[2];
  for (std::size_t k = 0; k < balls.size(); ++k)
    u[k] = r0[k] * (x - c0[k]) + r1[k] * (y - c1[k]) + r2[k] * (z - c2[k]);
}

/// Fills u and, in place of q, the logarithms of the balls' contributions at a point; returns the
/// largest.
double compute_logarithms(const Vector3d& at, const GroupBalls& balls, Terms& terms) {
  for (std::size_t axis = 0; axis < 3; ++axis) compute_u_component(at, balls, axis, terms.u(axis));
  const double *u0 = terms.u(0), *u1 = terms.u(1), *u2 = terms.u(2), *w = balls.w();
  double* __restrict q = terms.q();
  for (std::size_t k = 0; k < balls.size(); ++k)
    q[k] = w[k] - u0[k] * u0[k] - u1[k] * u1[k] - u2[k] * u2[k];
  return max_in_lanes(q, balls.size());
}

/// Converts logarithms to fractions of the field; returns psi.
double compute_weights(double top, Terms& terms) {
  double* q = terms.q();
  const std::size_t count = terms.size();
  for (std::size_t k = 0; k < count; ++k) q[k] -= top;
  exponentiate(q, count);
  const double sum = sum_in_lanes(q, count);
  for (std::size_t k = 0; k < count; ++k) q[k] /= sum;
  return top + exact::log(sum);
}

Term make_term(Terms& terms, const FitBall& ball, std::size_t k) {
  Term term{terms.q()[k], {terms.u(0)[k], terms.u(1)[k], terms.u(2)[k]}, {}};
  term.slope.noalias() = ball.root.transpose() * term.u;
  return term;
}

/// Values at a point that the derivatives of its residual share; g = |grad psi|. `steepness` is g,
/// clamped from below; `ratio` is psi / g, or 0 where g is clamped; `scale` is the root of the
/// residual's weight.
struct PointGradient {
  Vector3d direction = Vector3d::Zero();  ///< grad psi / g
  double steepness = 1, ratio = 0, scale = 1;
};
/// Computes the derivatives of scale psi / g with respect to (w, c, D), one per parameter of the
/// ball. With t = w - u^2, dg = q (dt (-2 slope . direction - g) + direction . d(-2 slope));
/// `along` = root direction, and put() takes dt and direction . d(-2 slope).
void derive(const Term& term, const FitBall& ball, const PointGradient& at,
            std::span<float> derivatives) {
  float* out = derivatives.data();
  const double factor = at.scale * term.q / at.steepness;
  const Vector3d along = ball.root * at.direction;
  const double t_factor = 1 - at.ratio * (-2 * term.slope.dot(at.direction) - at.steepness);
  const auto put = [&](double value_derivative, double slope_derivative) {
    *out++ =
        static_cast<float>(factor * (t_factor * value_derivative - at.ratio * slope_derivative));
  };
  put(1, 0);
  const Vector3d rotated_direction = ball.root.transpose() * along;
  for (int i = 0; i < 3; ++i) put(2 * term.slope[i], 2 * rotated_direction[i]);
  const Vector3d& u = term.u;
  if (derivatives.size() == std::size_t{kRoundParameters}) {
    put(-u.squaredNorm(), -2 * along.dot(u));
    return;
  }
  for (int i = 0; i < 3; ++i) put(-u[i] * u[i], -2 * along[i] * u[i]);
  for (const auto& [i, j] : {std::pair{0, 1}, {0, 2}, {1, 2}})
    put(-2 * u[i] * u[j], -2 * (along[i] * u[j] + along[j] * u[i]));
}

/// Computes grad psi / -2.
Vector3d compute_half_gradient(Terms& terms, const GroupBalls& balls) {
  Vector3d sum;
  const double *u0 = terms.u(0), *u1 = terms.u(1), *u2 = terms.u(2), *q = terms.q();
  double* __restrict product = terms.scratch();
  for (std::size_t c = 0; c < 3; ++c) {
    const double *r0 = balls.root(0, c), *r1 = balls.root(1, c), *r2 = balls.root(2, c);
    for (std::size_t k = 0; k < balls.size(); ++k)
      product[k] = q[k] * (r0[k] * u0[k] + r1[k] * u1[k] + r2[k] * u2[k]);
    sum[static_cast<Eigen::Index>(c)] = sum_in_lanes(product, balls.size());
  }
  return sum;
}

/// The balls near a group of points, and the other inputs of the points' rows.
struct PointBalls {
  const std::vector<FitBall>& all;
  const GroupBalls& group;
  Terms& terms;  ///< scratch
  double length;
  int parameters;  ///< per ball
};

/// Writes the per-point values of point p to `rows`, and appends its entries to `entries`. Returns
/// its cost.
double add_rows(std::size_t p, const FitPoint& point, const PointBalls& at, FitRows& rows,
                GroupRows& entries) {
  const auto& [all, balls, terms, length, parameters] = at;
  const double psi = compute_weights(compute_logarithms(point.point, balls, terms), terms);
  const Vector3d half = compute_half_gradient(terms, balls);
  const double slope = 2 * half.norm();
  const double steepness = std::max(slope, 0.5 / length);
  const Loss loss = compute_loss(point, psi, steepness, length);
  const double scale = std::sqrt(loss.weight);
  rows.residuals[p] = scale * loss.distance;
  rows.psi[p] = psi;
  rows.steepness[p] = steepness;
  PointGradient gradient{-2 * half / std::max(slope, 1e-300), steepness, 0, scale};
  if (slope == steepness) gradient.ratio = psi / steepness;
  const std::size_t first_entry = entries.balls.size();
  for (std::size_t k = 0; scale > 0 && k < balls.size(); ++k) {
    constexpr double kMinWeight = 5e-3;  // J omits balls with a smaller fraction of the field
    if (!(terms.q()[k] > kMinWeight)) continue;
    const FitBall& ball = all[balls.indices[k]];
    const Term term = make_term(terms, ball, k);
    entries.balls.push_back(balls.indices[k]);
    entries.weights.push_back(static_cast<float>(term.q));
    const auto numbers = static_cast<std::size_t>(parameters);
    entries.derivatives.resize(entries.derivatives.size() + numbers);
    derive(term, ball, gradient, std::span(entries.derivatives).last(numbers));
  }
  // For now a count; add_fit_rows() adds up the counts.
  rows.begins[p + 1] = static_cast<std::uint32_t>(entries.balls.size() - first_entry);
  return loss.cost;
}

}  // namespace

void add_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                  double length, int parameters, FitRows& rows) {
  // The last group, if it was not full, is evaluated again, because its list of balls depends on
  // all its points.
  const std::size_t first = rows.psi.size() / kGroupSize, first_point = first * kGroupSize;
  const std::size_t groups = (points.size() + kGroupSize - 1) / kGroupSize;
  rows.begins.resize(points.size() + 1);
  rows.balls.resize(rows.begins[first_point]);
  rows.weights.resize(rows.begins[first_point]);
  rows.derivatives.resize(rows.begins[first_point] * static_cast<std::size_t>(parameters));
  for (auto* values : {&rows.residuals, &rows.psi, &rows.steepness}) values->resize(points.size());
  rows.group_costs.resize(groups);
  std::vector<GroupRows> group_rows(groups - first);
  for_each_group(
      balls, points, first,
      [&](std::size_t g, const FitPoint* at, std::size_t count, const GroupBalls& near,
          Terms& terms) {
        GroupRows& entries = group_rows[g - first];
        constexpr std::size_t kTypicalEntries = 12;  // per point; reserves memory
        entries.balls.reserve(kTypicalEntries * count);
        entries.weights.reserve(kTypicalEntries * count);
        entries.derivatives.reserve(kTypicalEntries * count * static_cast<std::size_t>(parameters));
        double cost = 0;
        for (std::size_t i = 0; i < count; ++i)
          cost += add_rows(g * kGroupSize + i, at[i], {balls, near, terms, length, parameters},
                           rows, entries);
        rows.group_costs[g] = cost;
      });
  // Append the groups' entries.
  std::vector<std::size_t> ends{rows.balls.size()};
  for (const GroupRows& group : group_rows) ends.push_back(ends.back() + group.balls.size());
  const auto numbers = static_cast<std::size_t>(parameters);
  rows.balls.resize(ends.back());
  rows.weights.resize(ends.back());
  rows.derivatives.resize(ends.back() * numbers);
  parallel_for(
      static_cast<std::int64_t>(group_rows.size()),
      [&](std::int64_t k) {
        const auto g = static_cast<std::size_t>(k);
        const auto copy = [&](const auto& from, auto& to, std::size_t per_entry) {
          std::copy(from.begin(), from.end(),
                    to.begin() + static_cast<std::ptrdiff_t>(ends[g] * per_entry));
        };
        copy(group_rows[g].balls, rows.balls, 1);
        copy(group_rows[g].weights, rows.weights, 1);
        copy(group_rows[g].derivatives, rows.derivatives, numbers);
      },
      16);
  for (std::size_t p = first_point; p < points.size(); ++p) rows.begins[p + 1] += rows.begins[p];
  rows.cost = 0;
  for (const double cost : rows.group_costs) rows.cost += cost;  // in a fixed order
}

FitRows make_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                      double length, int parameters) {
  FitRows rows;
  add_fit_rows(balls, points, length, parameters, rows);
  return rows;
}

std::vector<std::uint8_t> test_inside_field(const std::vector<FitBall>& balls,
                                            const std::vector<FitPoint>& points) {
  std::vector<std::uint8_t> inside(points.size());
  for_each_group(balls, points, 0,
                 [&](std::size_t g, const FitPoint* at, std::size_t count, const GroupBalls& near,
                     Terms& terms) {
                   // psi = top + ln(sum), and the sum is between 1 and the number of balls.
                   const double max_log_sum = exact::log(static_cast<double>(near.size())) + 1e-6;
                   for (std::size_t i = 0; i < count; ++i) {
                     const double top = compute_logarithms(at[i].point, near, terms);
                     inside[g * kGroupSize + i] =
                         top > 0 || (top + max_log_sum > 0 && compute_weights(top, terms) > 0);
                   }
                 });
  return inside;
}

}  // namespace polymorph
