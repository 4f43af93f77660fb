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

/// Residuals at the points and the rows of the Jacobian J, in sparse form: the entries of a point
/// are the balls that it depends on.
struct FitRows {
  std::vector<double> residuals;            ///< one per point, times the root of its weight
  std::vector<double> psi;                  ///< one per point: ln of the field
  std::vector<double> steepness;            ///< one per point: |grad psi|, at least 0.5 / length
  std::vector<std::uint32_t> begins = {0};  ///< first entry of each point, and one past the end
  std::vector<std::uint32_t> balls;         ///< ball index per entry
  std::vector<float> weights;               ///< per entry, the ball's fraction of the field
  std::vector<float> derivatives;   ///< `parameters` values per entry, times the root of the weight
  std::vector<double> group_costs;  ///< loss of each group of 32 points; their sum is `cost`
  double cost = 0;                  ///< sum of Huber's loss

  /// Clears everything but keeps the memory.
  void clear() {
    for (auto* values : {&residuals, &psi, &steepness, &group_costs}) values->clear();
    begins.assign(1, 0);
  }
};

/// Computes the rows of all points. `length`: the diagonal of the model's box; `parameters`:
/// kEllipsoidParameters or kRoundParameters.
FitRows make_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                      double length, int parameters);

/// Adds the rows of the points that `rows` does not have yet, the last ones in `points`. The balls
/// must be the same as for the other rows.
void add_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                  double length, int parameters, FitRows& rows);

/// Tests at each point whether the field exceeds 1.
std::vector<std::uint8_t> test_inside_field(const std::vector<FitBall>& balls,
                                            const std::vector<FitPoint>& points);

}  // namespace polymorph
