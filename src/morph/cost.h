// Cost of assigning a ball of one object to a ball of another (docs/method.md, Plan).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/matrix_decompositions.h"
#include "kernels/types.h"
#include "scene/scene.h"

namespace polymorph {

struct PlanSide;  // morph/plan.h

/// Label of a ball without a label. Labels are numbers; balls of two objects with equal numbers
/// belong together.
constexpr std::int32_t kNoLabel = -1;

/// One object's balls as points of a feature space. The cost of a pair of balls is their squared
/// distance in this space, plus a constant if their labels differ (cost_row()).
struct CostSide {
  /// Number of axes that rotate with the object: 3 of the position, 3 of the outward direction.
  static constexpr std::size_t kRotatingAxes = 6;
  std::vector<double> mass;          ///< one per ball; sums to 1
  std::vector<std::int32_t> labels;  ///< one per ball; kNoLabel: none
  /// values[axis][ball]. Axes 0 to 2: position, in coordinates of a Normalization; 3 to 5: outward
  /// direction (morph/features.h); then the other terms of make_cost_side(). Each is multiplied by
  /// the square root of its weight; positions have the weight 1. The sides that limb_cost_sides()
  /// makes have other axes.
  std::vector<std::vector<float>> values;
  /// Index of the first axis that the search for a rotation (morph/align.h) ignores. The sides that
  /// limb_cost_sides() makes take over the axes from this one on.
  std::size_t first_pinned_axis = 0;
  std::size_t size() const { return mass.size(); }
};

/// Map from scene coordinates to coordinates whose unit is the object's RMS size: p -> (p - center)
/// / size.
struct Normalization {
  Vec3d center;
  double size = 1;
};
/// Computes the centroid of the balls and their RMS distance from it (1 if all are at one point),
/// weighted by mass. `mass`: one per ball, with sum 1.
Normalization fit_normalization(const std::vector<Ball>& balls, std::span<const double> mass);

/// Computes the feature vectors of an object's balls. `mass`: one per ball, with sum 1.
/// `normalization`: the object's own, or one that both objects share (AlignMethod::kNone).
CostSide make_cost_side(const PlanSide& object, FieldKind kind, std::vector<double> mass,
                        const Normalization& normalization, const PlanSettings& settings);

/// Rotates a side's positions and outward directions about the origin, which is the object's centre
/// if its normalization is its own.
CostSide rotate_side(const CostSide& side, const Mat3& rotation);

/// Computes the costs of pairing ball `from` of `a` with every ball of `b`. Adds `label_cost` where
/// labels differ; kNoLabel is compared like any other label.
void cost_row(const CostSide& a, const CostSide& b, float label_cost, std::uint32_t from,
              std::span<float> costs);

/// Reduces a side to at most `count` representative balls, chosen by farthest point sampling. Each
/// has the total mass, the mean values and the label with the largest mass of the balls nearest to
/// it.
CostSide coarsen_side(const CostSide& side, std::size_t count);

}  // namespace polymorph
