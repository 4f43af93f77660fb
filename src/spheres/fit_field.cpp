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

using Array = Eigen::ArrayXd;

/// The balls that may matter at the points of a group, those that can come within e^-9 of the
/// largest, side by side for vector code.
struct GroupBalls {
  std::vector<std::uint32_t> indices;
  Array center[3], root[3][3], w;

  GroupBalls(const std::vector<FitBall>& all, const std::vector<double>& norms,
             const FitPoint* points, std::size_t count) {
    constexpr double kNegligible = 9;
    Vector3d low = points[0].point, high = low;
    for (std::size_t i = 1; i < count; ++i) {
      low = low.cwiseMin(points[i].point);
      high = high.cwiseMax(points[i].point);
    }
    const Vector3d middle = (low + high) / 2;
    const double radius = (high - low).norm() / 2;
    std::vector<double> tops(all.size());
    double min_top = -1e300;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double distance = (all[i].root * (middle - all[i].center)).norm();
      const double reach = norms[i] * radius;
      const double near = std::max(0.0, distance - reach), far = distance + reach;
      tops[i] = all[i].w - near * near;
      min_top = std::max(min_top, all[i].w - far * far);
    }
    for (std::size_t i = 0; i < all.size(); ++i)
      if (tops[i] > min_top - kNegligible) indices.push_back(static_cast<std::uint32_t>(i));
    const auto n = static_cast<Eigen::Index>(indices.size());
    for (int r = 0; r < 3; ++r) {
      center[r].resize(n);
      for (int c = 0; c < 3; ++c) root[r][c].resize(n);
    }
    w.resize(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const FitBall& ball = all[indices[static_cast<std::size_t>(k)]];
      for (int r = 0; r < 3; ++r) {
        center[r][k] = ball.center[r];
        for (int c = 0; c < 3; ++c) root[r][c][k] = ball.root(r, c);
      }
      w[k] = ball.w;
    }
  }
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

/// Calls f(group, points, count) for all groups, in parallel.
template <class F>
void each_group(const std::vector<FitPoint>& points, const F& f) {
  parallel_for(
      static_cast<std::int64_t>((points.size() + kGroup - 1) / kGroup),
      [&](std::int64_t k) {
        const auto g = static_cast<std::size_t>(k);
        f(g, points.data() + g * kGroup, std::min(kGroup, points.size() - g * kGroup));
      },
      8);
}

/// u = root d of every ball of a group, and its share q.
struct Terms {
  Array u[3], q;
  Array part;  ///< for sums
};
struct Term {
  double q = 0;
  Vector3d u, slope;  // slope = root^T u
};

/// Rows of one group, appended.
struct GroupRows {
  std::vector<double> residuals, psi, steepness;
  std::vector<std::uint32_t> counts, balls;
  std::vector<float> shares, derivatives;
  double cost = 0;
};

/// e^x of each x <= 0, those below -50 as that. Without a branch, so that it becomes vector code;
/// the same bits for any width of vectors (base/exact_math.h).
void exponentials(double* x, Eigen::Index count) {
  for (Eigen::Index i = 0; i < count; ++i) {
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
double sum_of(const double* x, Eigen::Index count) {
  double sums[4] = {0, 0, 0, 0};
  Eigen::Index i = 0;
  for (; i + 4 <= count; i += 4)
    for (int k = 0; k < 4; ++k) sums[k] += x[i + k];
  for (int k = 0; i < count; ++i, ++k) sums[k] += x[i];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

/// Fills the terms at a point; returns psi.
double shares_at(const Vector3d& at, const GroupBalls& balls, Terms& terms) {
  const Array d[3] = {at[0] - balls.center[0], at[1] - balls.center[1], at[2] - balls.center[2]};
  for (int r = 0; r < 3; ++r)
    terms.u[r] = balls.root[r][0] * d[0] + balls.root[r][1] * d[1] + balls.root[r][2] * d[2];
  terms.q = balls.w - terms.u[0].square() - terms.u[1].square() - terms.u[2].square();
  const double top = terms.q.maxCoeff();
  terms.q -= top;
  exponentials(terms.q.data(), terms.q.size());
  const double sum = sum_of(terms.q.data(), terms.q.size());
  terms.q /= sum;
  return top + exact::log(sum);
}

Term term_of(const Terms& terms, const FitBall& ball, std::size_t index) {
  const auto k = static_cast<Eigen::Index>(index);
  Term term{terms.q[k], {terms.u[0][k], terms.u[1][k], terms.u[2][k]}, {}};
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
            std::vector<float>& out) {
  const double factor = scale * term.q / at.steepness;
  const Vector3d along = ball.root * at.direction;
  const double by_t = 1 - at.ratio * (-2 * term.slope.dot(at.direction) - at.steepness);
  const auto put = [&](double by_value, double by_slope) {
    out.push_back(static_cast<float>(factor * (by_t * by_value - at.ratio * by_slope)));
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
  for (int c = 0; c < 3; ++c) {
    terms.part = terms.q * (balls.root[0][c] * terms.u[0] + balls.root[1][c] * terms.u[1] +
                            balls.root[2][c] * terms.u[2]);
    sum[c] = sum_of(terms.part.data(), terms.part.size());
  }
  return sum;
}

void add_rows(const FitPoint& point, const std::vector<FitBall>& all, const GroupBalls& balls,
              Terms& terms, double length, int numbers, GroupRows& rows) {
  const double psi = shares_at(point.point, balls, terms);
  const Vector3d half = half_slope(terms, balls);
  const double slope = 2 * half.norm();
  const double steepness = std::max(slope, 0.5 / length);
  const Loss loss = loss_of(point, psi, steepness, length);
  const double scale = std::sqrt(loss.weight);
  rows.cost += loss.cost;
  rows.residuals.push_back(scale * loss.distance);
  rows.psi.push_back(psi);
  rows.steepness.push_back(steepness);
  Derivation derivation{-2 * half / std::max(slope, 1e-300), steepness, 0};
  if (slope == steepness) derivation.ratio = psi / steepness;
  std::uint32_t entries = 0;
  for (std::size_t k = 0; scale > 0 && k < balls.indices.size(); ++k) {
    constexpr double kMinShare = 5e-3;
    if (!(terms.q[static_cast<Eigen::Index>(k)] > kMinShare)) continue;
    const FitBall& ball = all[balls.indices[k]];
    const Term term = term_of(terms, ball, k);
    ++entries;
    rows.balls.push_back(balls.indices[k]);
    rows.shares.push_back(static_cast<float>(term.q));
    derive(term, ball, derivation, scale, numbers, rows.derivatives);
  }
  rows.counts.push_back(entries);
}

}  // namespace

FitRows fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                 double length, int numbers) {
  const std::vector<double> norms = norms_of(balls);
  std::vector<GroupRows> parts((points.size() + kGroup - 1) / kGroup);
  each_group(points, [&](std::size_t g, const FitPoint* first, std::size_t count) {
    const GroupBalls near(balls, norms, first, count);
    Terms terms;
    for (std::size_t i = 0; i < count; ++i)
      add_rows(first[i], balls, near, terms, length, numbers, parts[g]);
  });
  FitRows rows;
  rows.begins.push_back(0);
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  for (const GroupRows& part : parts) {  // in order: the sums do not depend on threads
    rows.cost += part.cost;
    append(rows.residuals, part.residuals);
    append(rows.psi, part.psi);
    append(rows.steepness, part.steepness);
    append(rows.balls, part.balls);
    append(rows.shares, part.shares);
    append(rows.derivatives, part.derivatives);
    for (const std::uint32_t n : part.counts) rows.begins.push_back(rows.begins.back() + n);
  }
  return rows;
}

std::vector<double> psi_at(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points) {
  const std::vector<double> norms = norms_of(balls);
  std::vector<double> psi(points.size());
  each_group(points, [&](std::size_t g, const FitPoint* first, std::size_t count) {
    const GroupBalls near(balls, norms, first, count);
    Terms terms;
    for (std::size_t i = 0; i < count; ++i)
      psi[g * kGroup + i] = shares_at(first[i].point, near, terms);
  });
  return psi;
}

}  // namespace polymorph
