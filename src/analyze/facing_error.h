// Facing: the rotation about the vertical axis from points to the points that they become.
#pragma once

#include <optional>
#include <span>

#include "base/matrix_decompositions.h"
#include "kernels/linear.h"

namespace polymorph {

/// Pairs of a point and the point that it becomes, with weights.
struct WeightedPairs {
  std::span<const Vec3d> from, to;
  std::span<const double> weights;  ///< one per pair; empty: all are 1
};

/// Fits the rotation about the y axis, in degrees from -180 to 180 (from z towards x), that takes
/// the points onto the points that they become (weighted Procrustes in the plane). The rotation
/// `applied` is applied to the points first. Both sets are relative to their centroids. Returns
/// nullopt if there are no pairs of positive weight, or if no rotation fits much better than the
/// others: if the covariance is below a tenth of the product of both standard deviations.
std::optional<double> rotation_about_vertical(const WeightedPairs& pairs, const Mat3& applied = {});

}  // namespace polymorph
