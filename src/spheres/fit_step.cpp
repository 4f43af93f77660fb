#include "spheres/fit_step.h"

#include <algorithm>

#include "base/parallel.h"
#include "kernels/simd_math.h"

namespace polymorph {
namespace {

using Vector = std::vector<double>;

/// Conjugate gradient solver with products with J^T J. kParameters is a compile-time constant, so
/// that inner loops unroll.
template <int kParameters>
class Solver {
  static constexpr std::size_t kSize = kParameters;
  using Block = Eigen::Matrix<double, kParameters, kParameters>;
  using Column = Eigen::Matrix<double, kParameters, 1>;

 public:
  Solver(const FitRows& rows, std::size_t ball_count, double damping)
      : rows_(rows), ball_count_(ball_count), products_(rows.chunks.size()) {
    constexpr std::size_t kSums = count_fit_sums(kParameters);
    Vector sums(ball_count * kSums);
    for (const FitChunk& chunk : rows.chunks)  // in a fixed order
      for (std::size_t slot = 0; slot < chunk.balls.size(); ++slot)
        for (std::size_t k = 0; k < kSums; ++k)
          sums[chunk.balls[slot] * kSums + k] += static_cast<double>(chunk.sums[slot * kSums + k]);
    negated_gradient_.resize(ball_count * kSize);
    diagonal_.resize(ball_count * kSize);
    blocks_.resize(ball_count);
    for_each_ball([&](std::size_t b) {
      const double* sum = sums.data() + b * kSums;
      for (std::size_t k = 0; k < kSize; ++k) negated_gradient_[b * kSize + k] = -*sum++;
      Block block;
      for (int row = 0; row < kParameters; ++row)
        for (int column = 0; column <= row; ++column)
          block(row, column) = block(column, row) = *sum++;
      // The two small terms keep the matrix regular where no residual depends on a parameter.
      const Column damped = damping * (block.diagonal().array() + 1e-9 * block.trace() + 1e-12);
      block.diagonal() += damped;
      Eigen::Map<Column>(diagonal_.data() + b * kSize) = damped;
      blocks_[b] = block.inverse();
    });
  }

  Vector solve() {
    constexpr int kMaxSteps = 25;
    // Relative to the residual: the step is damped and clamped anyway.
    constexpr double kTolerance = 0.1;
    Vector residual = negated_gradient_;
    Vector step(residual.size(), 0.0), z = precondition(residual), direction = z;
    double rho = dot(residual, z);
    const double max_rho = kTolerance * kTolerance * rho;
    for (int k = 0; k < kMaxSteps && rho > max_rho && rho > 0; ++k) {
      const Vector product = multiply(direction);
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
        [&](std::int64_t b) { f(static_cast<std::size_t>(b)); }, /*grain=*/32);
  }
  static double dot(const Vector& a, const Vector& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
  }
  /// Computes (J^T J + damping) v. Each chunk of J is read once; single precision suffices, as for
  /// J itself: the step is damped and clamped anyway.
  Vector multiply(const Vector& v) {
    parallel_ranges(static_cast<std::int64_t>(rows_.chunks.size()), /*grain=*/1,
                    [&](std::int64_t begin, std::int64_t end) {
                      std::vector<float> inputs;
                      std::vector<FitLanes> sums;
                      for (std::int64_t k = begin; k < end; ++k) {
                        const auto c = static_cast<std::size_t>(k);
                        multiply_chunk(rows_.chunks[c], v, inputs, sums, products_[c]);
                      }
                    });
    Vector product(v.size());
    for (std::size_t i = 0; i < v.size(); ++i) product[i] = diagonal_[i] * v[i];
    for (std::size_t c = 0; c < products_.size(); ++c) {  // in a fixed order
      const FitChunk& chunk = rows_.chunks[c];
      for (std::size_t slot = 0; slot < chunk.balls.size(); ++slot)
        for (std::size_t k = 0; k < kSize; ++k)
          product[chunk.balls[slot] * kSize + k] += products_[c][slot * kSize + k];
    }
    return product;
  }
  /// Computes the product of a chunk's J^T J with v, for the chunk's balls. `inputs` and `sums` are
  /// memory for intermediate values.
  static void multiply_chunk(const FitChunk& chunk, const Vector& v, std::vector<float>& inputs,
                             std::vector<FitLanes>& sums, Vector& product) {
    const std::size_t count = chunk.balls.size() * kSize;
    inputs.resize(count);
    for (std::size_t slot = 0; slot < chunk.balls.size(); ++slot)
      for (std::size_t k = 0; k < kSize; ++k)
        inputs[slot * kSize + k] = static_cast<float>(v[chunk.balls[slot] * kSize + k]);
    sums.assign(count, FitLanes{});
    const auto load = [](const FitLanes& from) { return Lanes<Pack>::load(from.lanes); };
    for (std::size_t pack = 0; pack + 1 < chunk.begins.size(); ++pack) {
      const std::uint32_t begin = chunk.begins[pack], end = chunk.begins[pack + 1];
      Pack at_points = {};  // J v
      for (std::uint32_t block = begin; block < end; ++block) {
        const FitLanes* d = chunk.derivatives.data() + block * kSize;
        const float* input = inputs.data() + chunk.block_balls[block] * kSize;
        Pack even = {}, odd = {};  // two sums that do not wait for each other
        for (std::size_t k = 0; k < kSize; ++k) {
          Pack& sum = k % 2 == 0 ? even : odd;
          sum = fma(load(d[k]), broadcast<Pack>(input[k]), sum);
        }
        at_points += even + odd;
      }
      for (std::uint32_t block = begin; block < end; ++block) {
        const FitLanes* d = chunk.derivatives.data() + block * kSize;
        FitLanes* sum = sums.data() + chunk.block_balls[block] * kSize;
        for (std::size_t k = 0; k < kSize; ++k)
          Lanes<Pack>::store(sum[k].lanes, fma(load(d[k]), at_points, load(sum[k])));
      }
    }
    product.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      double sum = 0;
      for (const float value : sums[i].lanes) sum += static_cast<double>(value);
      product[i] = sum;
    }
  }
  Vector precondition(const Vector& r) const {
    Vector z(r.size());
    for (std::size_t b = 0; b < ball_count_; ++b)
      Eigen::Map<Column>(z.data() + b * kSize).noalias() =
          blocks_[b] * Eigen::Map<const Column>(r.data() + b * kSize);
    return z;
  }

  const FitRows& rows_;
  std::size_t ball_count_;
  Vector negated_gradient_;       // -J^T r
  Vector diagonal_;               // what damping adds to the diagonal of J^T J
  std::vector<Block> blocks_;     // preconditioner: inverses of the damped matrix's diagonal blocks
  std::vector<Vector> products_;  // of each chunk; a member to reuse its memory
};

}  // namespace

std::vector<double> solve_damped_step(const FitRows& rows, std::size_t ball_count, int parameters,
                                      double damping) {
  return parameters == kRoundParameters
             ? Solver<kRoundParameters>(rows, ball_count, damping).solve()
             : Solver<kEllipsoidParameters>(rows, ball_count, damping).solve();
}

}  // namespace polymorph
