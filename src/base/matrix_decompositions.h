// Matrix decompositions (polar, logarithm, eigenvectors) of 3 x 3 matrices in double precision.
#pragma once

#include <array>

#include "kernels/linear.h"
#include "kernels/types.h"

namespace polymorph {

Mat3 from_columns(Vec3d x, Vec3d y, Vec3d z);

/// The rotation nearest to `a` (the U V^T of its singular values, without reflection): the R
/// that makes sum w (R p) . q largest when a = sum w q p^T. The identity where `a` is 0.
Mat3 nearest_rotation(const Mat3& a);

/// The axis times the angle (0..pi) of a rotation; exp_rotation() goes back.
Vec3d log_rotation(const Mat3& r);
double angle_of(const Mat3& r);

/// Principal axes of a symmetric matrix: values descending, their directions as columns.
struct Axes {
  std::array<double, 3> values{};
  Mat3 directions;
};
Axes axes_of(const Mat3& symmetric);

/// Matrix logarithm of a positive definite matrix; exp_symmetric() goes back.
Mat3 log_symmetric(const Mat3& a);

}  // namespace polymorph
