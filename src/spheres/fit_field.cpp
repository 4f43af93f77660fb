#include "spheres/fit_field.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "base/exact_math.h"
#include "base/parallel.h"

namespace polymorph {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kGroup = 32;  // points that share a list of balls

/// The balls that may matter at the points of a group, those that can come within e^-9 of the
/// largest, side by side for vector code. One is used again for group after group, so that it keeps
/// its memory.
class GroupBalls {
 public:
  std::vector<std::uint32_t> indices;

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
    tops_.resize(all.size());
    double min_top = -1e300;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double distance = (all[i].root * (middle - all[i].center)).norm();
      const double reach = norms[i] * radius;
      const double near = std::max(0.0, distance - reach), far = distance + reach;
      tops_[i] = all[i].w - near * near;
      min_top = std::max(min_top, all[i].w - far * far);
    }
    indices.clear();
    for (std::size_t i = 0; i < all.size(); ++i)
      if (tops_[i] > min_top - kNegligible) indices.push_back(static_cast<std::uint32_t>(i));
    numbers_.resize(13 * indices.size());
    for (std::size_t k = 0; k < indices.size(); ++k) {
      const FitBall& ball = all[indices[k]];
      double* at = numbers_.data() + k;
      const auto put = [&](double number) {
        *at = number;
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
  const double* row(std::size_t i) const { return numbers_.data() + i * indices.size(); }
  std::vector<double> numbers_, tops_;
};

/// A point's residual as it counts.
struct Loss {
  double distance = 0;  ///< psi / steepness - target
  double weight = 0;    ///< of its square, Huber's loss folded in (reweighted least squares)
  double cost = 0;
};

Loss loss_of(const FitPoint& point, double psi, double steepness, double length) {
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
      // Steeper than a distance is harmless; flatter means that a second sheet is near.
      if (loss.distance * point.target > 0) weight *= 0.2;
      break;
  }
  const double huber = 0.01 * length, size = std::abs(loss.distance);
  loss.cost = weight * (size <= huber ? size * size : huber * (2 * size - huber));
  loss.weight = weight * (size <= huber ? 1 : huber / size);
  return loss;
}

std::vector<double> norms_of(const std::vector<FitBall>& balls) {
  std::vector<double> norms;
  for (const FitBall& ball : balls) norms.push_back(ball.root.norm());
  return norms;
}

/// u = root d of every ball of a group, and its share q; like GroupBalls used again.
class Terms {
 public:
  void resize(std::size_t balls) {
    size_ = balls;
    numbers_.resize(5 * balls);
  }
  std::size_t size() const { return size_; }
  double* u(std::size_t axis) { return numbers_.data() + axis * size_; }
  double* q() { return u(3); }
  double* part() { return u(4); }  ///< for sums

 private:
  std::size_t size_ = 0;
  std::vector<double> numbers_;
};
struct Term {
  double q = 0;
  Vector3d u, slope;  // slope = root^T u
};

/// Calls f(group, points, count, balls, terms) for all groups from `first` on, in parallel.
template <class F>
void each_group(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                std::size_t first, const F& f) {
  const std::vector<double> norms = norms_of(balls);
  const std::size_t groups = (points.size() + kGroup - 1) / kGroup;
  parallel_ranges(static_cast<std::int64_t>(groups - first), 8,
                  [&](std::int64_t begin, std::int64_t end) {
                    GroupBalls near;
                    Terms terms;
                    for (std::int64_t k = begin; k < end; ++k) {
                      const std::size_t g = first + static_cast<std::size_t>(k);
                      const FitPoint* at = points.data() + g * kGroup;
                      const std::size_t count = std::min(kGroup, points.size() - g * kGroup);
                      near.collect(balls, norms, at, count);
                      terms.resize(near.size());
                      f(g, at, count, near, terms);
                    }
                  });
}

/// The entries of one group's rows.
struct GroupRows {
  std::vector<std::uint32_t> balls;
  std::vector<float> shares, derivatives;
};

/// e^x of each x <= 0, those below -50 as that. Without a branch, so that it becomes vector code;
/// the same bits for any width of vectors (base/exact_math.h).
void exponentials(double* x, std::size_t count) {
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

/// In four sums, whatever the width of vectors.
double sum_of(const double* x, std::size_t count) {
  double sums[4] = {0, 0, 0, 0};
  std::size_t i = 0;
  for (; i + 4 <= count; i += 4)
    for (std::size_t k = 0; k < 4; ++k) sums[k] += x[i + k];
  for (std::size_t k = 0; i < count; ++i, ++k) sums[k] += x[i];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

double max_of(const double* x, std::size_t count) {
  double tops[4] = {x[0], x[0], x[0], x[0]};
  std::size_t i = 0;
  for (; i + 4 <= count; i += 4)
    for (std::size_t k = 0; k < 4; ++k) tops[k] = x[i + k] > tops[k] ? x[i + k] : tops[k];
  for (; i < count; ++i) tops[0] = std::max(tops[0], x[i]);
  return std::max(std::max(tops[0], tops[1]), std::max(tops[2], tops[3]));
}

/// u = root (at - center), one number of all balls.
void turn(const Vector3d& at, const GroupBalls& balls, std::size_t axis, double* __restrict u) {
  const double *c0 = balls.center(0), *c1 = balls.center(1), *c2 = balls.center(2);
  const double *r0 = balls.root(axis, 0), *r1 = balls.root(axis, 1), *r2 = balls.root(axis, 2);
  const double x = at[0], y = at[1], z = at[2];
  for (std::size_t k = 0; k < balls.size(); ++k)
    u[k] = r0[k] * (x - c0[k]) + r1[k] * (y - c1[k]) + r2[k] * (z - c2[k]);
}

/// Fills u and, in place of q, the logarithms of the balls' strengths at a point; returns the
/// largest.
double logarithms_at(const Vector3d& at, const GroupBalls& balls, Terms& terms) {
  for (std::size_t axis = 0; axis < 3; ++axis) turn(at, balls, axis, terms.u(axis));
  const double *u0 = terms.u(0), *u1 = terms.u(1), *u2 = terms.u(2), *w = balls.w();
  double* __restrict q = terms.q();
  for (std::size_t k = 0; k < balls.size(); ++k)
    q[k] = w[k] - u0[k] * u0[k] - u1[k] * u1[k] - u2[k] * u2[k];
  return max_of(q, balls.size());
}

/// Makes shares of the logarithms; returns psi.
double shares_of(double top, Terms& terms) {
  double* q = terms.q();
  const std::size_t count = terms.size();
  for (std::size_t k = 0; k < count; ++k) q[k] -= top;
  exponentials(q, count);
  const double sum = sum_of(q, count);
  for (std::size_t k = 0; k < count; ++k) q[k] /= sum;
  return top + exact::log(sum);
}

Term term_of(Terms& terms, const FitBall& ball, std::size_t k) {
  Term term{terms.q()[k], {terms.u(0)[k], terms.u(1)[k], terms.u(2)[k]}, {}};
  term.slope.noalias() = ball.root.transpose() * term.u;
  return term;
}

/// d (psi / g) / d (w, c, D) times `factor`, g = |grad psi|. `along` = root grad / g; where the
/// steepness is held at its least, `ratio` = psi / g is given as 0. With t = w - u^2,
/// dg = q (dt (-2 slope . grad / g - g) + (grad / g) . d(-2 slope)).
struct Derivation {
  Vector3d direction = Vector3d::Zero();  ///< grad / g
  double steepness = 1, ratio = 0;
};
void derive(const Term& term, const FitBall& ball, const Derivation& at, double scale, int numbers,
            float* out) {
  const double factor = scale * term.q / at.steepness;
  const Vector3d along = ball.root * at.direction;
  const double by_t = 1 - at.ratio * (-2 * term.slope.dot(at.direction) - at.steepness);
  const auto put = [&](double by_value, double by_slope) {
    *out++ = static_cast<float>(factor * (by_t * by_value - at.ratio * by_slope));
  };
  put(1, 0);
  const Vector3d turned = ball.root.transpose() * along;
  for (int i = 0; i < 3; ++i) put(2 * term.slope[i], 2 * turned[i]);
  const Vector3d& u = term.u;
  if (numbers == kRoundNumbers) {
    put(-u.squaredNorm(), -2 * along.dot(u));
    return;
  }
  for (int i = 0; i < 3; ++i) put(-u[i] * u[i], -2 * along[i] * u[i]);
  for (const auto& [i, j] : {std::pair{0, 1}, {0, 2}, {1, 2}})
    put(-2 * u[i] * u[j], -2 * (along[i] * u[j] + along[j] * u[i]));
}

/// grad psi / -2.
Vector3d half_slope(Terms& terms, const GroupBalls& balls) {
  Vector3d sum;
  const double *u0 = terms.u(0), *u1 = terms.u(1), *u2 = terms.u(2), *q = terms.q();
  double* __restrict part = terms.part();
  for (std::size_t c = 0; c < 3; ++c) {
    const double *r0 = balls.root(0, c), *r1 = balls.root(1, c), *r2 = balls.root(2, c);
    for (std::size_t k = 0; k < balls.size(); ++k)
      part[k] = q[k] * (r0[k] * u0[k] + r1[k] * u1[k] + r2[k] * u2[k]);
    sum[static_cast<Eigen::Index>(c)] = sum_of(part, balls.size());
  }
  return sum;
}

/// Writes what `rows` has of point p, and adds its entries to `entries`. Returns its cost.
double add_rows(std::size_t p, const FitPoint& point, const std::vector<FitBall>& all,
                const GroupBalls& balls, Terms& terms, double length, int numbers, FitRows& rows,
                GroupRows& entries) {
  const double psi = shares_of(logarithms_at(point.point, balls, terms), terms);
  const Vector3d half = half_slope(terms, balls);
  const double slope = 2 * half.norm();
  const double steepness = std::max(slope, 0.5 / length);
  const Loss loss = loss_of(point, psi, steepness, length);
  const double scale = std::sqrt(loss.weight);
  rows.residuals[p] = scale * loss.distance;
  rows.psi[p] = psi;
  rows.steepness[p] = steepness;
  Derivation derivation{-2 * half / std::max(slope, 1e-300), steepness, 0};
  if (slope == steepness) derivation.ratio = psi / steepness;
  const std::size_t before = entries.balls.size();
  for (std::size_t k = 0; scale > 0 && k < balls.size(); ++k) {
    constexpr double kMinShare = 5e-3;
    if (!(terms.q()[k] > kMinShare)) continue;
    const FitBall& ball = all[balls.indices[k]];
    const Term term = term_of(terms, ball, k);
    entries.balls.push_back(balls.indices[k]);
    entries.shares.push_back(static_cast<float>(term.q));
    const std::size_t at = entries.derivatives.size();
    entries.derivatives.resize(at + static_cast<std::size_t>(numbers));
    derive(term, ball, derivation, scale, numbers, entries.derivatives.data() + at);
  }
  rows.begins[p + 1] = static_cast<std::uint32_t>(entries.balls.size() - before);
  return loss.cost;
}

}  // namespace

void add_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                  double length, int numbers, FitRows& rows) {
  // A group that was not full shares its list of balls with what is new.
  const std::size_t first = rows.psi.size() / kGroup, kept = first * kGroup;
  const std::size_t groups = (points.size() + kGroup - 1) / kGroup;
  rows.begins.resize(points.size() + 1);
  rows.balls.resize(rows.begins[kept]);
  rows.shares.resize(rows.begins[kept]);
  rows.derivatives.resize(rows.begins[kept] * static_cast<std::size_t>(numbers));
  for (auto* numbers_of_points : {&rows.residuals, &rows.psi, &rows.steepness})
    numbers_of_points->resize(points.size());
  rows.group_costs.resize(groups);
  std::vector<GroupRows> parts(groups - first);
  each_group(balls, points, first,
             [&](std::size_t g, const FitPoint* at, std::size_t count, const GroupBalls& near,
                 Terms& terms) {
               GroupRows& entries = parts[g - first];
               constexpr std::size_t kUsual = 12;  // entries of a point
               entries.balls.reserve(kUsual * count);
               entries.shares.reserve(kUsual * count);
               entries.derivatives.reserve(kUsual * count * static_cast<std::size_t>(numbers));
               double cost = 0;
               for (std::size_t i = 0; i < count; ++i)
                 cost += add_rows(g * kGroup + i, at[i], balls, near, terms, length, numbers, rows,
                                  entries);
               rows.group_costs[g] = cost;
             });
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  for (const GroupRows& part : parts) {
    append(rows.balls, part.balls);
    append(rows.shares, part.shares);
    append(rows.derivatives, part.derivatives);
  }
  for (std::size_t p = kept; p < points.size(); ++p) rows.begins[p + 1] += rows.begins[p];
  rows.cost = 0;
  for (const double cost : rows.group_costs) rows.cost += cost;  // in order, whatever the threads
}

FitRows fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                 double length, int numbers) {
  FitRows rows;
  add_fit_rows(balls, points, length, numbers, rows);
  return rows;
}

std::vector<std::uint8_t> inside_field(const std::vector<FitBall>& balls,
                                       const std::vector<FitPoint>& points) {
  std::vector<std::uint8_t> inside(points.size());
  each_group(balls, points, 0,
             [&](std::size_t g, const FitPoint* at, std::size_t count, const GroupBalls& near,
                 Terms& terms) {
               // psi = top + ln(sum), and the sum is between 1 and the number of balls.
               const double most = exact::log(static_cast<double>(near.size())) + 1e-6;
               for (std::size_t i = 0; i < count; ++i) {
                 const double top = logarithms_at(at[i].point, near, terms);
                 inside[g * kGroup + i] = top > 0 || (top + most > 0 && shares_of(top, terms) > 0);
               }
             });
  return inside;
}

}  // namespace polymorph
