// Residuals and Jacobian of the metaball fit.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// A ball during the fit. It adds exp(w - |root (x - center)|^2) to the field at x.
struct FitBall {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d root = Eigen::Matrix3d::Identity();  ///< root^T root = Ball::a * Ball::shape
  double w = 0;
};

/// Number of parameters of a ball. For an ellipsoid: w, the centre (3) and a symmetric matrix D (6)
/// that changes `root` to (1 + D/2) root. For a round ball, D is a multiple of the identity, with 1
/// parameter.
inline constexpr int kEllipsoidParameters = 10;
inline constexpr int kRoundParameters = 5;

/// A constraint at a point: the first-order signed distance psi / |grad psi|, with psi = ln(field),
/// is to equal a target.
struct FitPoint {
  enum class Rule : std::uint8_t {
    kSurface,  ///< equal to the target
    kInside,   ///< not below the target
    kOutside,  ///< not above the target
    /// Equal to the target, but with a lower weight where the distance is further from 0.
    kOffset,
  };
  Eigen::Vector3d point;
  double target = 0;  ///< signed distance, positive inside
  double weight = 1;  ///< weight of the squared residual
  Rule rule = Rule::kSurface;
};

/// Number of consecutive points that are evaluated at once. Their values are lanes of a vector.
inline constexpr std::size_t kFitLanes = 8;
/// One value for each of kFitLanes points.
struct alignas(kFitLanes * sizeof(float)) FitLanes {
  float lanes[kFitLanes];
};

/// Number of points that are evaluated one after the other by one thread.
inline constexpr std::size_t kFitChunkSize = 1024;

/// Rows of the Jacobian J of kFitChunkSize consecutive points, in sparse form. A block is a ball's
/// entries at kFitLanes points; they are 0 at points that do not depend on the ball.
struct FitChunk {
  std::vector<std::uint32_t> balls;        ///< indices of the balls that have blocks
  std::vector<std::uint32_t> begins;       ///< first block of each kFitLanes points, and the end
  std::vector<std::uint32_t> block_balls;  ///< ball of each block, as an index into `balls`
  std::vector<FitLanes> weights;           ///< per block, the ball's fraction of the field, or 0
  std::vector<FitLanes> derivatives;       ///< `parameters` per block, times the root of the weight
  /// Per ball: its `parameters` numbers of J^T r, where r are the residuals, and the lower triangle
  /// of its diagonal block of J^T J, row by row.
  std::vector<float> sums;
  double cost = 0;  ///< sum of Huber's loss

  /// Clears everything but keeps the memory.
  void clear() {
    for (auto* indices : {&balls, &begins, &block_balls}) indices->clear();
    for (auto* values : {&weights, &derivatives}) values->clear();
    sums.clear();
    cost = 0;
  }
};

/// Number of values per ball in FitChunk::sums.
constexpr int count_fit_sums(int parameters) {
  return parameters + parameters * (parameters + 1) / 2;
}

/// Residuals at the points and the rows of the Jacobian J.
struct FitRows {
  std::size_t point_count = 0;
  std::vector<float> residuals;  ///< one per point, times the root of its weight
  std::vector<float> psi;        ///< one per point: ln of the field
  std::vector<float> steepness;  ///< one per point: |grad psi|, at least 0.5 / length
  std::vector<FitChunk> chunks;
  double cost = 0;  ///< sum of Huber's loss
};

/// Calls f(ball, weight, block) for each ball on which point p depends. `weight` is the ball's
/// fraction of the field, and `block` an index in the point's chunk.
template <class F>
void for_each_fit_entry(const FitRows& rows, std::size_t p, const F& f) {
  const FitChunk& chunk = rows.chunks[p / kFitChunkSize];
  const std::size_t pack = p % kFitChunkSize / kFitLanes;
  for (std::uint32_t block = chunk.begins[pack]; block < chunk.begins[pack + 1]; ++block)
    if (const float weight = chunk.weights[block].lanes[p % kFitLanes]; weight > 0)
      f(chunk.balls[chunk.block_balls[block]], weight, block);
}

/// Computes the rows of all points, in single precision. `length`: the diagonal of the model's box;
/// `parameters`: kEllipsoidParameters or kRoundParameters. `rows` is replaced, but its memory is
/// used again.
void compute_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                      double length, int parameters, FitRows& rows);

/// Adds the rows of the points that `rows` does not have yet, the last ones in `points`. The balls
/// must be the same as for the other rows.
void add_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                  double length, int parameters, FitRows& rows);

/// Computes FitRows::cost alone, which takes less time than the rows.
double compute_fit_cost(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                        double length);

/// Tests at each point whether the field exceeds 1.
std::vector<std::uint8_t> test_inside_field(const std::vector<FitBall>& balls,
                                            const std::vector<FitPoint>& points);

}  // namespace polymorph
