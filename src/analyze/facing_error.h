// Facing: the turn about the vertical between points and those that they become.
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

/// Returns the rotation about the y axis, in degrees from -180 to 180 (from z towards x), that
/// takes the points nearest to those that they become, all about their centroids, after `applied`
/// was applied to them (weighted Procrustes in the plane). Nothing where no rotation is much better
/// than another: the covariance keeps less than a tenth of both sides' spread.
std::optional<double> turn_about_vertical(const WeightedPairs& pairs, const Mat3& applied = {});

}  // namespace polymorph
