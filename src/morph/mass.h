// Mass of balls: the fraction of an object's volume that belongs to each ball.
#pragma once

#include <vector>

#include "kernels/linear.h"
#include "kernels/types.h"

namespace polymorph {

/// Computes each ball's share of the volume inside the surface, where the field exceeds 1. In a
/// Gaussian field, the share is the integral of (the ball's value / the field's value) over that
/// volume, estimated at fixed points around the ball. In other fields, the share is the volume of
/// the ball alone. The shares are scaled to a sum of 1; each ball gets at least 1e-4 of the mean.
/// If the balls enclose nothing, all shares are equal. Parallel, deterministic.
std::vector<double> ball_masses(const std::vector<Ball>& balls, FieldKind kind);

/// RMS distance of the points of the volume inside the surface from `center`, estimated as in
/// ball_masses(); > 0, and 1 if the balls enclose nothing. Parallel, deterministic.
double radius_of_gyration(const std::vector<Ball>& balls, FieldKind kind, Vec3d center);

}  // namespace polymorph
