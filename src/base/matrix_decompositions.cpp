#include "base/matrix_decompositions.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/exact_math.h"

namespace polymorph {
namespace {

using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Matrix to_eigen(const Mat3& a) { return Eigen::Map<const Matrix>(a.m); }
Mat3 from_eigen(const Matrix& matrix) {
  Mat3 a;
  Eigen::Map<Matrix>(a.m) = matrix;
  return a;
}

/// Applies f to the eigenvalues of a symmetric matrix. The eigenvectors do not change.
template <class F>
Mat3 apply_to_eigenvalues(const Mat3& a, const F& f) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(to_eigen(a));
  const Eigen::Vector3d values = solver.eigenvalues().unaryExpr(f);
  return from_eigen(solver.eigenvectors() * values.asDiagonal() *
                    solver.eigenvectors().transpose());
}

}  // namespace

Mat3 from_columns(Vec3d x, Vec3d y, Vec3d z) {
  return {{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}};
}

Mat3 nearest_rotation(const Mat3& a) {
  const Matrix matrix = to_eigen(a);
  if (!(matrix.norm() > 0)) return {};
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  // Undo a reflection along the direction of the smallest singular value (Umeyama 1991).
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);
  return from_eigen(u * svd.matrixV().transpose());
}

Vec3d log_rotation(const Mat3& r) {
  const Eigen::Quaterniond rotation{Eigen::Matrix3d(to_eigen(r))};
  const double half_sine = rotation.vec().norm();  // sin(angle / 2)
  if (half_sine == 0) return {};
  const double angle = 2 * exact::atan2(half_sine, std::abs(rotation.w()));
  const Eigen::Vector3d v = rotation.vec() * ((rotation.w() < 0 ? -angle : angle) / half_sine);
  return {v.x(), v.y(), v.z()};
}

Vec3d log_rotation_near(const Mat3& r, Vec3d preferred) {
  const Vec3d shortest = log_rotation(r);
  const double angle = length(shortest);
  if (!(angle > 1e-6)) return shortest;  // the axis of `other` would not be well defined
  const Vec3d other = shortest * ((angle - 2 * std::numbers::pi) / angle);
  return length(other - preferred) < length(shortest - preferred) ? other : shortest;
}

double rotation_angle(const Mat3& r) {
  const Vec3d v = log_rotation(r);
  return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
}

EigenDecomposition principal_axes(const Mat3& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(to_eigen(symmetric));
  EigenDecomposition axes;
  for (int k = 0; k < 3; ++k) {  // Eigen sorts in ascending order
    axes.values[static_cast<std::size_t>(k)] = solver.eigenvalues()(2 - k);
    for (int i = 0; i < 3; ++i) axes.directions.at(i, k) = solver.eigenvectors()(i, 2 - k);
  }
  return axes;
}

Mat3 log_symmetric(const Mat3& a) {
  return apply_to_eigenvalues(a, [](double v) { return exact::log(std::max(v, 1e-12)); });
}

}  // namespace polymorph
