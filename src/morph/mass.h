// Mass of balls: the fraction of an object's volume that each of its balls stands for.
#pragma once

#include <vector>

#include "kernels/linear.h"
#include "kernels/types.h"

namespace polymorph {

/// Each ball's share of the volume inside the surface: the integral of its part of the field over
/// field > 1, estimated at fixed points around it (Gaussian), or its lone volume (other fields).
/// Sums to 1; a ball that has next to nothing inside still gets 1e-4 of the mean. Parallel,
/// deterministic.
std::vector<double> ball_masses(const std::vector<Ball>& balls, FieldKind kind);

/// The root of the mean squared distance from `center` of what lies inside the surface, estimated
/// at the same points; > 0. Parallel, deterministic.
double radius_of_gyration(const std::vector<Ball>& balls, FieldKind kind, Vec3d center);

}  // namespace polymorph
