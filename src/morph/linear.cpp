#include "morph/linear.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace polymorph {
namespace {

using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Matrix to_eigen(const Mat3& a) { return Eigen::Map<const Matrix>(a.m.data()); }
Mat3 from_eigen(const Matrix& matrix) {
  Mat3 a;
  Eigen::Map<Matrix>(a.m.data()) = matrix;
  return a;
}

template <class F>
Mat3 on_values(const Mat3& a, const F& f) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(to_eigen(a));
  const Eigen::Vector3d values = solver.eigenvalues().unaryExpr(f);
  return from_eigen(solver.eigenvectors() * values.asDiagonal() *
                    solver.eigenvectors().transpose());
}

}  // namespace

Vec3d operator*(const Mat3& a, Vec3d v) {
  return {a.m[0] * v.x + a.m[1] * v.y + a.m[2] * v.z, a.m[3] * v.x + a.m[4] * v.y + a.m[5] * v.z,
          a.m[6] * v.x + a.m[7] * v.y + a.m[8] * v.z};
}

Mat3 operator*(const Mat3& a, const Mat3& b) {
  Mat3 c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      c.at(i, j) = a.at(i, 0) * b.at(0, j) + a.at(i, 1) * b.at(1, j) + a.at(i, 2) * b.at(2, j);
  return c;
}

Mat3 transposed(const Mat3& a) {
  return {{a.m[0], a.m[3], a.m[6], a.m[1], a.m[4], a.m[7], a.m[2], a.m[5], a.m[8]}};
}

Mat3 from_columns(Vec3d x, Vec3d y, Vec3d z) {
  return {{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}};
}

Mat3 nearest_rotation(const Mat3& a) {
  const Matrix matrix = to_eigen(a);
  if (!(matrix.norm() > 0)) return {};
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  // Umeyama 1991: a reflection is undone along the direction that matters least.
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);
  return from_eigen(u * svd.matrixV().transpose());
}

Vec3d log_rotation(const Mat3& r) {
  const Eigen::AngleAxisd turn{Eigen::Matrix3d(to_eigen(r))};
  const Eigen::Vector3d v = turn.axis() * turn.angle();
  return {v.x(), v.y(), v.z()};
}

Mat3 exp_rotation(Vec3d v) {
  const Eigen::Vector3d axis(v.x, v.y, v.z);
  const double angle = axis.norm();
  if (!(angle > 0)) return {};
  return from_eigen(Eigen::AngleAxisd(angle, axis / angle).toRotationMatrix());
}

double angle_of(const Mat3& r) {
  const Vec3d v = log_rotation(r);
  return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
}

Mat3 to_mat3(const Sym3& s) {
  return {{static_cast<double>(s.xx), static_cast<double>(s.xy), static_cast<double>(s.xz),
           static_cast<double>(s.xy), static_cast<double>(s.yy), static_cast<double>(s.yz),
           static_cast<double>(s.xz), static_cast<double>(s.yz), static_cast<double>(s.zz)}};
}

Sym3 to_sym3(const Mat3& a) {
  return {static_cast<float>(a.m[0]), static_cast<float>(a.m[4]), static_cast<float>(a.m[8]),
          static_cast<float>(a.m[1]), static_cast<float>(a.m[2]), static_cast<float>(a.m[5])};
}

Axes axes_of(const Mat3& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(to_eigen(symmetric));  // ascending
  Axes axes;
  for (int k = 0; k < 3; ++k) {
    axes.values[static_cast<std::size_t>(k)] = solver.eigenvalues()(2 - k);
    for (int i = 0; i < 3; ++i) axes.directions.at(i, k) = solver.eigenvectors()(i, 2 - k);
  }
  return axes;
}

Mat3 log_symmetric(const Mat3& a) {
  return on_values(a, [](double v) { return std::log(std::max(v, 1e-12)); });
}

Mat3 exp_symmetric(const Mat3& a) {
  return on_values(a, [](double v) { return std::exp(v); });
}

}  // namespace polymorph
