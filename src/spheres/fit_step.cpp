#include "spheres/fit_step.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/parallel.h"

namespace polymorph {
namespace {

using Vector = std::vector<double>;

/// A copy of J sorted by ball, each ball's entries in the order of the points. Products with J^T
/// then read contiguous memory, about twenty times per step. The entries of ball b are begins[b] to
/// begins[b + 1] - 1; `points` has the point index of each.
template <int kParameters>
struct EntriesByBall {
  std::vector<std::uint32_t> begins, points;
  std::vector<float> derivatives;

  EntriesByBall(const FitRows& rows, std::size_t ball_count)
      : begins(ball_count + 1, 0), points(rows.balls.size()), derivatives(rows.derivatives.size()) {
    // A counting sort in chunks of points: each chunk counts its entries of each ball, which gives
    // the slots that it writes to.
    constexpr std::size_t kChunks = 16;  // fixed: any number of threads gives the same order
    const std::size_t point_count = rows.begins.size() - 1;
    const auto for_each_entry = [&](std::size_t chunk, const auto& f) {
      const std::size_t end = point_count * (chunk + 1) / kChunks;
      for (std::size_t p = point_count * chunk / kChunks; p < end; ++p)
        for (std::uint32_t e = rows.begins[p]; e < rows.begins[p + 1]; ++e) f(p, e);
    };
    std::vector<std::uint32_t> next(kChunks * ball_count, 0);
    parallel_for(kChunks, [&](std::int64_t k) {
      const auto chunk = static_cast<std::size_t>(k);
      std::uint32_t* counts = next.data() + chunk * ball_count;
      for_each_entry(chunk, [&](std::size_t, std::uint32_t e) { ++counts[rows.balls[e]]; });
    });
    std::uint32_t slot_count = 0;
    for (std::size_t ball = 0; ball < ball_count; ++ball) {
      for (std::size_t chunk = 0; chunk < kChunks; ++chunk)
        slot_count += std::exchange(next[chunk * ball_count + ball], slot_count);
      begins[ball + 1] = slot_count;
    }
    parallel_for(kChunks, [&](std::int64_t k) {
      const auto chunk = static_cast<std::size_t>(k);
      std::uint32_t* slots = next.data() + chunk * ball_count;
      for_each_entry(chunk, [&](std::size_t p, std::uint32_t e) {
        const std::size_t slot = slots[rows.balls[e]]++;
        points[slot] = static_cast<std::uint32_t>(p);
        std::memcpy(derivatives.data() + slot * kParameters,
                    rows.derivatives.data() + std::size_t{e} * kParameters,
                    sizeof(float) * kParameters);
      });
    });
  }
  const float* at(std::size_t entry) const { return derivatives.data() + entry * kParameters; }
};

/// Conjugate gradient solver with products with J and J^T. kParameters is a compile-time constant,
/// so that inner loops unroll.
template <int kParameters>
class Solver {
  using Block = Eigen::Matrix<double, kParameters, kParameters>;
  using Column = Eigen::Matrix<double, kParameters, 1>;
  using Derivatives = Eigen::Map<const Eigen::Matrix<float, kParameters, 1>>;

 public:
  Solver(const FitRows& rows, std::size_t ball_count, double damping)
      : rows_(rows), by_ball_(rows, ball_count), ball_count_(ball_count) {
    diagonal_.resize(ball_count * kParameters);
    blocks_.resize(ball_count);
    for_each_ball([&](std::size_t b) {
      Block block = Block::Zero();
      for (std::uint32_t i = by_ball_.begins[b]; i < by_ball_.begins[b + 1]; ++i) {
        double d[kParameters];
        for (int k = 0; k < kParameters; ++k) d[k] = static_cast<double>(by_ball_.at(i)[k]);
        for (int column = 0; column < kParameters; ++column)
          for (int row = 0; row < kParameters; ++row)
            block.data()[column * kParameters + row] += d[row] * d[column];
      }
      // The two small terms keep the matrix regular where no residual depends on a parameter.
      const Column damped = damping * (block.diagonal().array() + 1e-9 * block.trace() + 1e-12);
      block.diagonal() += damped;
      Eigen::Map<Column>(diagonal_.data() + b * kParameters) = damped;
      blocks_[b] = block.inverse();
    });
  }

  Vector solve() const {
    constexpr int kMaxSteps = 25;
    // Relative to the residual: the step is damped and clamped anyway.
    constexpr double kTolerance = 0.1;
    Vector negated_residuals(rows_.residuals.size());
    for (std::size_t i = 0; i < negated_residuals.size(); ++i)
      negated_residuals[i] = -rows_.residuals[i];
    Vector residual = transposed_times(negated_residuals);
    Vector step(residual.size(), 0.0), z = precondition(residual), direction = z;
    double rho = dot(residual, z);
    const double max_rho = kTolerance * kTolerance * rho;
    for (int k = 0; k < kMaxSteps && rho > max_rho && rho > 0; ++k) {
      Vector product = transposed_times(times(direction));
      for (std::size_t i = 0; i < product.size(); ++i) product[i] += diagonal_[i] * direction[i];
      const double alpha = rho / dot(direction, product);
      for (std::size_t i = 0; i < step.size(); ++i) {
        step[i] += alpha * direction[i];
        residual[i] -= alpha * product[i];
      }
      z = precondition(residual);
      const double next = dot(residual, z);
      for (std::size_t i = 0; i < step.size(); ++i) direction[i] = z[i] + next / rho * direction[i];
      rho = next;
    }
    return step;
  }

 private:
  template <class F>
  void for_each_ball(const F& f) const {
    parallel_for(
        static_cast<std::int64_t>(ball_count_),
        [&](std::int64_t b) { f(static_cast<std::size_t>(b)); }, /*grain=*/8);
  }
  Derivatives derivatives(std::uint32_t entry) const {
    return Derivatives(rows_.derivatives.data() + static_cast<std::size_t>(entry) * kParameters);
  }
  static double dot(const Vector& a, const Vector& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
  }
  /// Computes J v.
  Vector times(const Vector& v) const {
    // Single precision suffices, as for J itself: the step is damped and clamped anyway.
    const std::vector<float> single(v.begin(), v.end());
    Vector product(rows_.residuals.size());
    parallel_for(
        static_cast<std::int64_t>(product.size()),
        [&](std::int64_t k) {
          const auto p = static_cast<std::size_t>(k);
          float sum = 0;
          for (std::uint32_t e = rows_.begins[p]; e < rows_.begins[p + 1]; ++e)
            sum += derivatives(e).dot(
                Derivatives(single.data() + std::size_t{rows_.balls[e]} * kParameters));
          product[p] = static_cast<double>(sum);
        },
        /*grain=*/1024);
    return product;
  }
  /// Computes J^T r.
  Vector transposed_times(const Vector& r) const {
    Vector product(ball_count_ * kParameters);
    for_each_ball([&](std::size_t b) {
      double sum[kParameters] = {};
      for (std::uint32_t i = by_ball_.begins[b]; i < by_ball_.begins[b + 1]; ++i) {
        const double value = r[by_ball_.points[i]];
        const float* d = by_ball_.at(i);
        for (int k = 0; k < kParameters; ++k) sum[k] += value * static_cast<double>(d[k]);
      }
      std::copy_n(sum, kParameters, product.begin() + static_cast<std::ptrdiff_t>(b * kParameters));
    });
    return product;
  }
  Vector precondition(const Vector& r) const {
    Vector z(r.size());
    for_each_ball([&](std::size_t b) {
      Eigen::Map<Column>(z.data() + b * kParameters).noalias() =
          blocks_[b] * Eigen::Map<const Column>(r.data() + b * kParameters);
    });
    return z;
  }

  const FitRows& rows_;
  EntriesByBall<kParameters> by_ball_;
  std::size_t ball_count_;
  Vector diagonal_;            // what damping adds to the diagonal of J^T J
  std::vector<Block> blocks_;  // preconditioner: inverses of the damped matrix's diagonal blocks
};

}  // namespace

std::vector<double> solve_damped_step(const FitRows& rows, std::size_t ball_count, int parameters,
                                      double damping) {
  return parameters == kRoundParameters
             ? Solver<kRoundParameters>(rows, ball_count, damping).solve()
             : Solver<kEllipsoidParameters>(rows, ball_count, damping).solve();
}

}  // namespace polymorph
