// Assignment cost between two balls (docs/method.md, Plan).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/matrix_decompositions.h"
#include "kernels/types.h"
#include "scene/scene.h"

namespace polymorph {

/// A ball's label in a plan: equal numbers belong together.
constexpr std::int32_t kNoLabel = -1;

/// One object's balls as points of a feature space. The cost of a pair of balls is their squared
/// distance there, and a constant where their labels differ. The first axes rotate with the object.
struct CostSide {
  static constexpr std::size_t kRotatingAxes =
      6;                                     ///< axes that rotate: position, outward direction
  static constexpr std::size_t kPlain = 10;  ///< axes before the distances to landmarks
  std::vector<double> mass;                  ///< sums to 1
  std::vector<std::int32_t> labels;
  /// values[axis][ball]: position (unit RMS), outward direction, ln size, geodesic distance,
  /// linearity, planarity, and the distance to each landmark; each times the square root of its
  /// weight.
  std::vector<std::vector<float>> values;
  std::size_t size() const { return mass.size(); }
};

/// Map from scene coordinates to unit-RMS coordinates: (p - center) / size.
struct Normalization {
  Vec3d center;
  double size = 1;
};
Normalization fit_normalization(const std::vector<Ball>& balls, std::span<const double> mass);

/// Computes the feature vectors. `landmarks`: in scene coordinates, in the same order on both
/// sides.
CostSide cost_side(const std::vector<Ball>& balls, FieldKind kind, std::vector<double> mass,
                   std::vector<std::int32_t> labels, std::span<const Vec3> landmarks,
                   const Normalization& normalization, const PlanSettings& settings);

/// Rotates a side about its origin, the object's centre.
CostSide rotate_side(const CostSide& side, const Mat3& rotation);

/// Computes the costs of ball `from` of `a` with every ball of `b`; adds `label_cost` where labels
/// differ.
void cost_row(const CostSide& a, const CostSide& b, float label_cost, std::uint32_t from,
              std::span<float> costs);

/// Reduces a side to at most `count` representatives (farthest point sampling). Each has the mass,
/// the mean values and the most common label of the balls nearest to it.
CostSide coarse(const CostSide& side, std::size_t count);

}  // namespace polymorph
