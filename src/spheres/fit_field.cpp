#include "spheres/fit_field.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "base/exact_math.h"
#include "base/parallel.h"
#include "mesh/four_doubles.h"

namespace polymorph {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kGroupSize = 32;  // points that use a common list of balls

/// Balls as a structure of arrays, for the bounds of groups.
struct BallArrays {
  std::vector<double> center[3], root[3][3], w, norm;

  explicit BallArrays(const std::vector<FitBall>& balls) {
    for (const FitBall& ball : balls) {
      for (Eigen::Index r = 0; r < 3; ++r) {
        center[r].push_back(ball.center[r]);
        for (Eigen::Index c = 0; c < 3; ++c) root[r][c].push_back(ball.root(r, c));
      }
      w.push_back(ball.w);
      norm.push_back(ball.root.norm());
    }
  }
};

/// Ball of a group, in the order in which its numbers are read.
struct GroupBall {
  double center[3], root[3][3], w;
};

/// Balls that may matter at the points of a group (whose contribution may exceed e^-9 times the
/// largest). One object is reused for many groups, so that it keeps its memory.
class GroupBalls {
 public:
  std::vector<std::uint32_t> indices;
  std::vector<GroupBall> balls;

  void collect(const BallArrays& all, const FitPoint* points, std::size_t count) {
    constexpr double kNegligible = 9;
    Vector3d low = points[0].point, high = low;
    for (std::size_t i = 1; i < count; ++i) {
      low = low.cwiseMin(points[i].point);
      high = high.cwiseMax(points[i].point);
    }
    const double max_lower_bound = find_bounds(all, (low + high) / 2, (high - low).norm() / 2);
    indices.clear();
    for (std::size_t i = 0; i < upper_bounds_.size(); ++i)
      if (upper_bounds_[i] > max_lower_bound - kNegligible)
        indices.push_back(static_cast<std::uint32_t>(i));
    balls.resize(indices.size());
    for (std::size_t k = 0; k < indices.size(); ++k) {
      const std::size_t i = indices[k];
      GroupBall& ball = balls[k];
      for (std::size_t r = 0; r < 3; ++r) {
        ball.center[r] = all.center[r][i];
        for (std::size_t c = 0; c < 3; ++c) ball.root[r][c] = all.root[r][c][i];
      }
      ball.w = all.w[i];
    }
  }
  std::size_t size() const { return indices.size(); }

 private:
  /// Sets bounds of the logarithm of each ball's contribution within `radius` of `middle`; returns
  /// the largest lower bound. Within the radius, |root (x - center)| changes by at most `extent`.
  double find_bounds(const BallArrays& all, const Vector3d& middle, double radius) {
    const std::size_t count = all.w.size();
    upper_bounds_.resize(count);
    lower_bounds_.resize(count);
    const double *c0 = all.center[0].data(), *c1 = all.center[1].data(), *c2 = all.center[2].data();
    const double *r00 = all.root[0][0].data(), *r01 = all.root[0][1].data(),
                 *r02 = all.root[0][2].data(), *r10 = all.root[1][0].data(),
                 *r11 = all.root[1][1].data(), *r12 = all.root[1][2].data(),
                 *r20 = all.root[2][0].data(), *r21 = all.root[2][1].data(),
                 *r22 = all.root[2][2].data(), *w = all.w.data(), *norm = all.norm.data();
    double* __restrict upper = upper_bounds_.data(), * __restrict lower = lower_bounds_.data();
    const double mx = middle[0], my = middle[1], mz = middle[2];
    for (std::size_t i = 0; i < count; ++i) {
      const double x = mx - c0[i], y = my - c1[i], z = mz - c2[i];
      const double u0 = r00[i] * x + (r01[i] * y + r02[i] * z),
                   u1 = r10[i] * x + (r11[i] * y + r12[i] * z),
                   u2 = r20[i] * x + (r21[i] * y + r22[i] * z);
      const double distance = std::sqrt(u0 * u0 + (u1 * u1 + u2 * u2)), extent = norm[i] * radius;
      const double inner = distance - extent, near = inner > 0.0 ? inner : 0.0,
                   far = distance + extent;
      upper[i] = w[i] - near * near;
      lower[i] = w[i] - far * far;
    }
    double max_lower_bound = -1e300;
    for (std::size_t i = 0; i < count; ++i) max_lower_bound = std::max(max_lower_bound, lower[i]);
    return max_lower_bound;
  }

  std::vector<double> upper_bounds_, lower_bounds_;
};

/// A point's residual and loss.
struct Loss {
  double difference = 0;  ///< psi / steepness - target
  double weight = 0;      ///< weight of `difference` squared that represents Huber's loss (IRLS)
  double cost = 0;        ///< Huber's loss
};

Loss compute_loss(const FitPoint& point, double psi, double steepness, double length) {
  Loss loss;
  loss.difference = psi / steepness - point.target;
  double weight = point.weight;
  switch (point.rule) {
    case FitPoint::Rule::kSurface:
      break;
    case FitPoint::Rule::kInside:
      if (loss.difference > 0) weight = 0;
      break;
    case FitPoint::Rule::kOutside:
      if (loss.difference < 0) weight = 0;
      break;
    case FitPoint::Rule::kOffset:
      // A field steeper than a distance is harmless; a flatter one means that a second sheet is
      // near.
      if (loss.difference * point.target > 0) weight *= 0.2;
      break;
  }
  const double huber = 0.01 * length, size = std::abs(loss.difference);
  loss.cost = weight * (size <= huber ? size * size : huber * (2 * size - huber));
  loss.weight = weight * (size <= huber ? 1 : huber / size);
  return loss;
}

/// Number of points that are evaluated at the same time. Each has the bits that it has alone.
constexpr std::size_t kLanes = 4;

/// Values of a ball at kLanes points: u = root (x - center), and q, the ball's fraction of the
/// field.
struct BallTerms {
  FourDoubles u[3], q;
};

/// kLanes points of a group, and the values of its balls there. Like GroupBalls, one object is
/// reused for many groups.
struct PointTerms {
  FourDoubles position[3];
  std::vector<BallTerms> balls;
  FourDoubles top;               ///< largest logarithm of a ball's contribution
  FourDoubles psi;               ///< ln of the field
  FourDoubles half_gradient[3];  ///< grad psi / -2

  /// Sets the positions of `count` points; unused lanes repeat the last one.
  void set_points(const FitPoint* points, std::size_t count) {
    for (std::size_t k = 0; k < kLanes; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        position[axis][k] = points[std::min(k, count - 1)].point[static_cast<Eigen::Index>(axis)];
  }
};

/// Values of a ball at one point: those of BallTerms, and slope = root^T u. The gradient of the
/// logarithm of the ball's contribution is -2 slope.
struct Term {
  double q = 0;
  Vector3d u, slope;
};

/// Calls f(group, points, count, balls, terms) for all groups from `first` on, in parallel.
/// `points` has the group's `count` points, `balls` its GroupBalls; `terms` is memory for their
/// values.
template <class F>
void for_each_group(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                    std::size_t first, const F& f) {
  const BallArrays arrays(balls);
  const std::size_t groups = (points.size() + kGroupSize - 1) / kGroupSize;
  parallel_ranges(static_cast<std::int64_t>(groups - first), /*grain=*/8,
                  [&](std::int64_t begin, std::int64_t end) {
                    GroupBalls near;
                    PointTerms terms;
                    for (std::int64_t k = begin; k < end; ++k) {
                      const std::size_t g = first + static_cast<std::size_t>(k);
                      const FitPoint* at = points.data() + g * kGroupSize;
                      const std::size_t count =
                          std::min(kGroupSize, points.size() - g * kGroupSize);
                      near.collect(arrays, at, count);
                      terms.balls.resize(near.size());
                      f(g, at, count, near, terms);
                    }
                  });
}

/// The entries of one group's rows.
struct GroupRows {
  std::vector<std::uint32_t> balls;
  std::vector<float> weights, derivatives;
};

/// Computes e^x for x <= 0 by the steps of exact::exp() (base/exact_math.h); values below -50 count
/// as -50.
inline FourDoubles exponentiate(FourDoubles x) {
  const FourDoubles a = x > -50.0 ? x : FourDoubles{} - 50.0;
  const FourDoubles shifted = a * (1 / exact::kLn2) + 0x1.8p52, n = shifted - 0x1.8p52;
  const FourDoubles r = (a - n * 0x1.62e42feep-1) - n * 0x1.a39ef35793c76p-33;
  FourDoubles p = r * (1.0 / 479001600) + 1.0 / 39916800;
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
  return std::bit_cast<FourDoubles>(std::bit_cast<FourIntegers>(p) +
                                    (std::bit_cast<FourIntegers>(shifted) << 52));
}

/// Sum over the balls of a group. Its four partial sums do not wait for each other.
struct FourSums {
  FourDoubles partial[4] = {};
  void add(std::size_t ball, FourDoubles value) { partial[ball % 4] += value; }
  FourDoubles total() const { return (partial[0] + partial[1]) + (partial[2] + partial[3]); }
};

/// Fills u and, in place of q, the logarithms of the balls' contributions; sets `top` to the
/// largest.
void compute_logarithms(const GroupBalls& group, PointTerms& at) {
  const FourDoubles x = at.position[0], y = at.position[1], z = at.position[2];
  FourDoubles top = {};
  for (std::size_t k = 0; k < group.size(); ++k) {
    const GroupBall& ball = group.balls[k];
    BallTerms& terms = at.balls[k];
    const FourDoubles dx = x - ball.center[0], dy = y - ball.center[1], dz = z - ball.center[2];
    FourDoubles q = FourDoubles{} + ball.w;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double* r = ball.root[axis];
      const FourDoubles u = r[0] * dx + r[1] * dy + r[2] * dz;
      terms.u[axis] = u;
      q -= u * u;
    }
    terms.q = q;
    top = k == 0 ? q : q > top ? q : top;
  }
  at.top = top;
}

/// Converts logarithms to fractions of the field; sets psi.
void compute_weights(PointTerms& at) {
  FourSums sums;
  for (std::size_t k = 0; k < at.balls.size(); ++k) {
    const FourDoubles q = exponentiate(at.balls[k].q - at.top);
    at.balls[k].q = q;
    sums.add(k, q);
  }
  const FourDoubles sum = sums.total();
  for (BallTerms& terms : at.balls) terms.q /= sum;
  for (std::size_t k = 0; k < kLanes; ++k) at.psi[k] = at.top[k] + exact::log(sum[k]);
}

/// Values at a point that the derivatives of its residual share; g = |grad psi|. `steepness` is g,
/// clamped from below; `ratio` is psi / g, or 0 where g is clamped; `scale` is the root of the
/// residual's weight.
struct PointGradient {
  Vector3d direction = Vector3d::Zero();  ///< grad psi / g
  double steepness = 1, ratio = 0, scale = 1;
};
/// Computes the derivatives of scale psi / g with respect to (w, c, D), one per parameter of the
/// ball. Let d be the derivative with respect to a parameter, and t = w - |u|^2. Then d psi = q dt
/// and dg = q (dt (-2 slope . direction - g) + direction . d(-2 slope)). put() takes dt and
/// direction . d(-2 slope).
void derive(const Term& term, const FitBall& ball, const PointGradient& at,
            std::span<float> derivatives) {
  float* out = derivatives.data();
  const double factor = at.scale * term.q / at.steepness;
  const Vector3d root_direction = ball.root * at.direction;
  const double t_factor = 1 - at.ratio * (-2 * term.slope.dot(at.direction) - at.steepness);
  const auto put = [&](double value_derivative, double slope_derivative) {
    *out++ =
        static_cast<float>(factor * (t_factor * value_derivative - at.ratio * slope_derivative));
  };
  put(1, 0);
  const Vector3d shape_direction = ball.root.transpose() * root_direction;
  for (int i = 0; i < 3; ++i) put(2 * term.slope[i], 2 * shape_direction[i]);
  const Vector3d& u = term.u;
  if (derivatives.size() == std::size_t{kRoundParameters}) {
    put(-u.squaredNorm(), -2 * root_direction.dot(u));
    return;
  }
  for (int i = 0; i < 3; ++i) put(-u[i] * u[i], -2 * root_direction[i] * u[i]);
  for (const auto& [i, j] : {std::pair{0, 1}, {0, 2}, {1, 2}})
    put(-2 * u[i] * u[j], -2 * (root_direction[i] * u[j] + root_direction[j] * u[i]));
}

/// Computes grad psi / -2.
void compute_half_gradients(const GroupBalls& group, PointTerms& at) {
  FourSums sums[3];
  for (std::size_t k = 0; k < group.size(); ++k) {
    const auto& r = group.balls[k].root;
    const BallTerms& terms = at.balls[k];
    for (std::size_t c = 0; c < 3; ++c)
      sums[c].add(k,
                  terms.q * (r[0][c] * terms.u[0] + r[1][c] * terms.u[1] + r[2][c] * terms.u[2]));
  }
  for (std::size_t c = 0; c < 3; ++c) at.half_gradient[c] = sums[c].total();
}

/// Inputs of the rows of kLanes points of a group.
struct RowInputs {
  const std::vector<FitPoint>& points;
  const std::vector<FitBall>& balls;
  const GroupBalls& group;
  const PointTerms& terms;                            ///< values at the points
  const std::vector<std::uint32_t> (&taken)[kLanes];  ///< list_balls() of `terms`
  double length;
  int parameters;  ///< per ball
};

/// Writes the per-point values of point p, whose values are in a lane of the inputs' terms, to
/// `rows`. Appends an entry for each of the balls taken at the point to `entries`. Returns the
/// point's cost.
double add_row(const RowInputs& inputs, std::size_t p, std::size_t lane, FitRows& rows,
               GroupRows& entries) {
  const auto& [points, balls, group, terms, taken, length, parameters] = inputs;
  const double psi = terms.psi[lane];
  const Vector3d half_gradient(terms.half_gradient[0][lane], terms.half_gradient[1][lane],
                               terms.half_gradient[2][lane]);
  const double gradient_norm = 2 * half_gradient.norm();
  const double steepness = std::max(gradient_norm, 0.5 / length);
  const Loss loss = compute_loss(points[p], psi, steepness, length);
  const double scale = std::sqrt(loss.weight);
  rows.residuals[p] = scale * loss.difference;
  rows.psi[p] = psi;
  rows.steepness[p] = steepness;
  PointGradient gradient{-2 * half_gradient / std::max(gradient_norm, 1e-300), steepness,
                         /*ratio=*/0, scale};
  if (gradient_norm == steepness) gradient.ratio = psi / steepness;
  const std::size_t first_entry = entries.balls.size();
  const auto stride = static_cast<std::size_t>(parameters);
  if (scale > 0) {
    entries.derivatives.resize((first_entry + taken[lane].size()) * stride);
    for (const std::uint32_t k : taken[lane]) {
      const std::uint32_t index = group.indices[k];
      const BallTerms& values = terms.balls[k];
      Term term{values.q[lane], {values.u[0][lane], values.u[1][lane], values.u[2][lane]}, {}};
      term.slope.noalias() = balls[index].root.transpose() * term.u;
      derive(term, balls[index], gradient,
             std::span(entries.derivatives).subspan(entries.balls.size() * stride, stride));
      entries.balls.push_back(index);
      entries.weights.push_back(static_cast<float>(term.q));
    }
  }
  // This is a count until add_fit_rows() adds up the counts.
  rows.begins[p + 1] = static_cast<std::uint32_t>(entries.balls.size() - first_entry);
  return loss.cost;
}

/// Lists, for each lane, the balls that get an entry of J: those with at least kMinWeight of the
/// field.
void list_balls(const PointTerms& terms, std::vector<std::uint32_t> (&taken)[kLanes]) {
  constexpr double kMinWeight = 5e-3;
  for (auto& list : taken) list.clear();
  for (std::size_t k = 0; k < terms.balls.size(); ++k) {
    const FourIntegers is_taken = terms.balls[k].q > kMinWeight;
    for (unsigned mask = mask_of(is_taken); mask != 0; mask &= mask - 1)
      taken[std::countr_zero(mask)].push_back(static_cast<std::uint32_t>(k));
  }
}

}  // namespace

void add_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                  double length, int parameters, FitRows& rows) {
  // The last group, if it was not full, is evaluated again, because its list of balls depends on
  // all its points.
  const std::size_t first_group = rows.psi.size() / kGroupSize,
                    first_point = first_group * kGroupSize;
  const std::size_t groups = (points.size() + kGroupSize - 1) / kGroupSize;
  rows.begins.resize(points.size() + 1);
  rows.balls.resize(rows.begins[first_point]);
  rows.weights.resize(rows.begins[first_point]);
  rows.derivatives.resize(rows.begins[first_point] * static_cast<std::size_t>(parameters));
  for (auto* values : {&rows.residuals, &rows.psi, &rows.steepness}) values->resize(points.size());
  rows.group_costs.resize(groups);
  std::vector<GroupRows> group_rows(groups - first_group);
  for_each_group(
      balls, points, first_group,
      [&](std::size_t g, const FitPoint* at, std::size_t count, const GroupBalls& near,
          PointTerms& terms) {
        GroupRows& entries = group_rows[g - first_group];
        constexpr std::size_t kTypicalEntries = 12;  // per point; reserves memory
        entries.balls.reserve(kTypicalEntries * count);
        entries.weights.reserve(kTypicalEntries * count);
        entries.derivatives.reserve(kTypicalEntries * count * static_cast<std::size_t>(parameters));
        std::vector<std::uint32_t> taken[kLanes];
        const RowInputs inputs{points, balls, near, terms, taken, length, parameters};
        double cost = 0;
        for (std::size_t i = 0; i < count; i += kLanes) {
          terms.set_points(at + i, std::min(kLanes, count - i));
          compute_logarithms(near, terms);
          compute_weights(terms);
          compute_half_gradients(near, terms);
          list_balls(terms, taken);
          for (std::size_t k = 0; k < kLanes && i + k < count; ++k)
            cost += add_row(inputs, g * kGroupSize + i + k, k, rows, entries);
        }
        rows.group_costs[g] = cost;
      });
  // Append the groups' entries.
  std::vector<std::size_t> ends{rows.balls.size()};
  for (const GroupRows& group : group_rows) ends.push_back(ends.back() + group.balls.size());
  const auto stride = static_cast<std::size_t>(parameters);
  rows.balls.resize(ends.back());
  rows.weights.resize(ends.back());
  rows.derivatives.resize(ends.back() * stride);
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
        copy(group_rows[g].derivatives, rows.derivatives, stride);
      },
      /*grain=*/16);
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
  for_each_group(balls, points, /*first=*/0,
                 [&](std::size_t g, const FitPoint* at, std::size_t count, const GroupBalls& near,
                     PointTerms& terms) {
                   // psi = top + ln(sum), and the sum is between 1 and the number of balls.
                   const double max_log_sum = exact::log(static_cast<double>(near.size())) + 1e-6;
                   for (std::size_t i = 0; i < count; i += kLanes) {
                     terms.set_points(at + i, std::min(kLanes, count - i));
                     compute_logarithms(near, terms);
                     bool has_weights = false;
                     for (std::size_t k = 0; k < kLanes && i + k < count; ++k) {
                       const double top = terms.top[k];
                       if (!has_weights && !(top > 0) && top + max_log_sum > 0) {
                         compute_weights(terms);
                         has_weights = true;
                       }
                       inside[g * kGroupSize + i + k] =
                           top > 0 || (top + max_log_sum > 0 && terms.psi[k] > 0);
                     }
                   }
                 });
  return inside;
}

}  // namespace polymorph
