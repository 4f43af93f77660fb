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

/// One object as the plan's cost sees it. Every term but the labels' is a squared distance of
/// numbers, so a ball is a point of a space whose first axes turn with the object.
struct CostSide {
  static constexpr std::size_t kTurning = 6;  ///< position, then outward direction
  static constexpr std::size_t kPlain = 10;   ///< all but the distances to landmarks
  std::vector<double> mass;                   ///< sums to 1
  std::vector<std::int32_t> labels;
  /// values[axis][ball]: position (unit RMS), outward, ln size, distance, linearity, planarity, and
  /// the distance to each landmark; each times the root of its weight.
  std::vector<std::vector<float>> values;
  std::size_t size() const { return mass.size(); }
};

/// The map of an object's places to unit-RMS coordinates: (p - center) / size.
struct Normalization {
  Vec3d center;
  double size = 1;
};
Normalization fit_normalization(const std::vector<Ball>& balls, std::span<const double> mass);

/// `landmarks`: in the object's own coordinates; those of the other side in the same order.
CostSide cost_side(const std::vector<Ball>& balls, FieldKind kind, std::vector<double> mass,
                   std::vector<std::int32_t> labels, std::span<const Vec3> landmarks,
                   const Normalization& normalization, const PlanSettings& settings);

/// The side, turned about its centre.
CostSide rotate_side(const CostSide& side, const Mat3& rotation);

/// The costs of ball `from` of `a` to every ball of `b`; `label_cost` where labels differ.
void cost_row(const CostSide& a, const CostSide& b, float label_cost, std::uint32_t from,
              std::span<float> costs);

/// Picks at most `count` balls that stand for all: far from each other, each with the mass and the
/// mean values of what is nearest to it.
CostSide coarse(const CostSide& side, std::size_t count);

}  // namespace polymorph
