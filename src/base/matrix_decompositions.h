// Matrix decompositions (polar, logarithm, eigenvectors) of 3 x 3 matrices in double precision.
#pragma once

#include <array>

#include "kernels/linear.h"
#include "kernels/types.h"

namespace polymorph {

Mat3 from_columns(Vec3d x, Vec3d y, Vec3d z);

/// Computes the rotation nearest to `a` (U V^T of its singular value decomposition, without
/// reflection): the R that maximizes sum w (R p) . q for a = sum w q p^T. Returns the identity if
/// `a` is 0.
Mat3 nearest_rotation(const Mat3& a);

/// Logarithm of a rotation: its axis times its angle (0..pi); the inverse of exp_rotation().
Vec3d log_rotation(const Mat3& r);
/// Two vectors describe a rotation: angle t about an axis, or 2 pi - t about the opposite axis.
/// Returns the one that is nearer to `preferred`, while log_rotation() returns the shorter one.
/// Ignores `preferred` if t <= 1e-6 (radians).
Vec3d log_rotation_near(const Mat3& r, Vec3d preferred);
/// Angle of a rotation, 0..pi.
double rotation_angle(const Mat3& r);

/// Eigenvalues of a symmetric matrix in descending order, and its eigenvectors as columns.
struct EigenDecomposition {
  std::array<double, 3> values{};
  Mat3 directions;
};
EigenDecomposition principal_axes(const Mat3& symmetric);

/// Matrix logarithm of a symmetric positive definite matrix; inverts exp_symmetric(). Eigenvalues
/// below 1e-12 count as 1e-12.
Mat3 log_symmetric(const Mat3& a);

}  // namespace polymorph
