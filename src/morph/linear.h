// The little linear algebra of alignment and motion: 3 x 3 matrices, in double.
#pragma once

#include <array>

#include "kernels/types.h"
#include "model/vec3d.h"

namespace polymorph {

/// Row-major; the identity by default.
struct Mat3 {
  std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};
  double at(int row, int column) const { return m[static_cast<std::size_t>(3 * row + column)]; }
  double& at(int row, int column) { return m[static_cast<std::size_t>(3 * row + column)]; }
};

Vec3d operator*(const Mat3& a, Vec3d v);
Mat3 operator*(const Mat3& a, const Mat3& b);
Mat3 transposed(const Mat3& a);
Mat3 from_columns(Vec3d x, Vec3d y, Vec3d z);

/// The turn nearest to `a` (the U V^T of its singular values, without reflection): the rotation R
/// that makes sum w (R p) . q largest when a = sum w q p^T. The identity where `a` is 0.
Mat3 nearest_rotation(const Mat3& a);

/// The axis times the angle (0..pi) of a rotation, and back (Rodrigues).
Vec3d log_rotation(const Mat3& r);
Mat3 exp_rotation(Vec3d axis_times_angle);
double angle_of(const Mat3& r);

Mat3 to_mat3(const Sym3& s);
Sym3 to_sym3(const Mat3& a);

/// Principal axes of a symmetric matrix: values descending, their directions as columns.
struct Axes {
  std::array<double, 3> values{};
  Mat3 directions;
};
Axes axes_of(const Mat3& symmetric);

/// Matrix logarithm of a positive definite matrix, and back.
Mat3 log_symmetric(const Mat3& a);
Mat3 exp_symmetric(const Mat3& a);

}  // namespace polymorph
