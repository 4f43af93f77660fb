// Residuals and Jacobian of the metaball fit.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// A ball while it is fitted: contributes exp(w - |root (x - center)|^2).
struct FitBall {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d root = Eigen::Matrix3d::Identity();  ///< root^T root = a shape
  double w = 0;
};

/// Numbers of a ball: w, centre (3), and the symmetric D (6) of root <- (1 + D/2) root, or its one
/// diagonal number for round balls.
inline constexpr int kEllipsoidNumbers = 10;
inline constexpr int kRoundNumbers = 5;

/// What is wanted at a point: psi / |grad psi| = target.
struct FitPoint {
  enum class Rule : std::uint8_t {
    kSurface,  ///< as it stands
    kInside,   ///< at least the target: no residual where it is more
    kOutside,  ///< at most the target
    /// Offset samples: little weight on the side where the field only falls faster than a distance.
    kOffset,
  };
  Eigen::Vector3d point;
  double target = 0;  ///< inside positive
  double weight = 1;  ///< of the square
  Rule rule = Rule::kSurface;
};

/// Residuals at the points and the rows of J: which balls each depends on, and how.
struct FitRows {
  std::vector<double> residuals;            ///< one per point, already times the root of its weight
  std::vector<double> psi;                  ///< one per point: ln of the field
  std::vector<double> steepness;            ///< one per point: |grad psi|, at least 0.5 / length
  std::vector<std::uint32_t> begins = {0};  ///< first entry of each point, and one past the end
  std::vector<std::uint32_t> balls;         ///< of each entry
  std::vector<float> shares;                ///< q of each entry
  std::vector<float> derivatives;   ///< `numbers` of each entry, times the root of the weight
  std::vector<double> group_costs;  ///< of 32 points each; they add up to:
  double cost = 0;                  ///< sum of Huber's loss

  /// Forgets everything but the memory.
  void clear() {
    for (auto* numbers : {&residuals, &psi, &steepness, &group_costs}) numbers->clear();
    begins.assign(1, 0);
  }
};

/// `length` is the diagonal of the model's box; `numbers` of a ball 5 or 10.
FitRows fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                 double length, int numbers);

/// Adds the rows of the points that `rows` lacks, those beyond its number of points: what
/// fit_rows() says of all, where `rows` is what it says of the first for the same balls.
void add_fit_rows(const std::vector<FitBall>& balls, const std::vector<FitPoint>& points,
                  double length, int numbers, FitRows& rows);

/// Whether the field is more than 1 at each of the points.
std::vector<std::uint8_t> inside_field(const std::vector<FitBall>& balls,
                                       const std::vector<FitPoint>& points);

}  // namespace polymorph
