// Facing: the rotation about the vertical between points and those that they become.
#pragma once

#include <optional>
#include <span>

#include "base/matrix_decompositions.h"
#include "kernels/linear.h"

namespace polymorph {

/// Points that become others, each with its weight.
struct WeightedPairs {
  std::span<const Vec3d> from, to;
  std::span<const double> weights;  ///< one per pair; empty: all count alike
};

/// Fits the rotation about the y axis, in degrees from -180 to 180 (from z towards x), that takes
/// the points, after the rotation `applied`, onto those that they become, both relative to their
/// centroids (weighted Procrustes in the plane). Returns nothing if no rotation fits much better
/// than the others: if the covariance is below a tenth of the product of both standard deviations.
std::optional<double> rotation_about_vertical(const WeightedPairs& pairs, const Mat3& applied = {});

}  // namespace polymorph
