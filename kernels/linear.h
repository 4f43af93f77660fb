// Vectors and 3 x 3 matrices in double precision, with the exponentials of numbers, symmetric
// matrices and rotations that the motion of balls needs; the same bits on the CPU and on the GPU
// (simd_math.h).
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "host_device.h"
#include "types.h"

namespace polymorph {

struct Vec3d {
  double x = 0, y = 0, z = 0;
  constexpr Vec3d() = default;
  PM_HD constexpr Vec3d(double x_, double y_, double z_) : x(x_), y(y_), z(z_) {}
  PM_HD constexpr explicit Vec3d(Vec3 p)
      : x(static_cast<double>(p.x)), y(static_cast<double>(p.y)), z(static_cast<double>(p.z)) {}
};

PM_HD constexpr Vec3d operator+(Vec3d a, Vec3d b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
PM_HD constexpr Vec3d operator-(Vec3d a, Vec3d b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
PM_HD constexpr Vec3d operator*(Vec3d a, double s) { return {a.x * s, a.y * s, a.z * s}; }
PM_HD constexpr double dot(Vec3d a, Vec3d b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
PM_HD constexpr Vec3d cross(Vec3d a, Vec3d b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
PM_HD inline double length(Vec3d a) { return std::sqrt(dot(a, a)); }
/// The unit vector along `a`; the zero vector stays zero.
PM_HD inline Vec3d normalized(Vec3d a) {
  const double n = length(a);
  return n > 0 ? a * (1 / n) : Vec3d{};
}
PM_HD constexpr Vec3 to_float(Vec3d a) {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

/// A 3 x 3 matrix, row by row; the identity by default.
struct Mat3 {
  double m[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  PM_HD constexpr double at(int row, int column) const { return m[3 * row + column]; }
  PM_HD constexpr double& at(int row, int column) { return m[3 * row + column]; }
};

PM_HD constexpr Vec3d operator*(const Mat3& a, Vec3d v) {
  return {a.m[0] * v.x + a.m[1] * v.y + a.m[2] * v.z, a.m[3] * v.x + a.m[4] * v.y + a.m[5] * v.z,
          a.m[6] * v.x + a.m[7] * v.y + a.m[8] * v.z};
}
PM_HD constexpr Mat3 operator*(const Mat3& a, const Mat3& b) {
  Mat3 c;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      c.at(i, j) = a.at(i, 0) * b.at(0, j) + a.at(i, 1) * b.at(1, j) + a.at(i, 2) * b.at(2, j);
    }
  }
  return c;
}
PM_HD constexpr Mat3 transposed(const Mat3& a) {
  return {{a.m[0], a.m[3], a.m[6], a.m[1], a.m[4], a.m[7], a.m[2], a.m[5], a.m[8]}};
}

/// A symmetric 3 x 3 matrix; zero by default.
struct Sym3d {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
};
PM_HD constexpr Sym3d operator+(const Sym3d& a, const Sym3d& b) {
  return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
}
PM_HD constexpr Sym3d operator*(const Sym3d& a, double s) {
  return {a.xx * s, a.yy * s, a.zz * s, a.xy * s, a.xz * s, a.yz * s};
}
PM_HD constexpr Mat3 to_mat3(const Sym3d& a) {
  return {{a.xx, a.xy, a.xz, a.xy, a.yy, a.yz, a.xz, a.yz, a.zz}};
}
/// Converts a matrix that is symmetric.
PM_HD constexpr Sym3d to_sym3d(const Mat3& a) {
  return {a.m[0], a.m[4], a.m[8], a.m[1], a.m[2], a.m[5]};
}
PM_HD constexpr Sym3 to_sym3(const Mat3& a) {
  return {static_cast<float>(a.m[0]), static_cast<float>(a.m[4]), static_cast<float>(a.m[8]),
          static_cast<float>(a.m[1]), static_cast<float>(a.m[2]), static_cast<float>(a.m[5])};
}
PM_HD constexpr Mat3 to_mat3(const Sym3& s) {
  return to_mat3(Sym3d{static_cast<double>(s.xx), static_cast<double>(s.yy),
                       static_cast<double>(s.zz), static_cast<double>(s.xy),
                       static_cast<double>(s.xz), static_cast<double>(s.yz)});
}

/// Returns the product of two symmetric matrices that commute, which is symmetric.
PM_HD constexpr Sym3d commuting_product(const Sym3d& a, const Sym3d& b) {
  return {a.xx * b.xx + a.xy * b.xy + a.xz * b.xz, a.xy * b.xy + a.yy * b.yy + a.yz * b.yz,
          a.xz * b.xz + a.yz * b.yz + a.zz * b.zz, a.xx * b.xy + a.xy * b.yy + a.xz * b.yz,
          a.xx * b.xz + a.xy * b.yz + a.xz * b.zz, a.xy * b.xz + a.yy * b.yz + a.yz * b.zz};
}

/// Number of terms of the exponential series, and the largest argument to which it is applied. The
/// terms left out then add up to less than 2^-51.
constexpr int kExpTerms = 9;
constexpr double kMaxExpArgument = 0.125;

/// Returns e^x: a series at x / 2^k, squared k times.
PM_HD inline double exp_scalar(double x) {
  int k = 0;
  // The limit of 64 ends the loop for an infinite x.
  for (double size = x < 0 ? -x : x; size > kMaxExpArgument && k < 64; size /= 2) ++k, x /= 2;
  double sum = 1;
  for (int i = kExpTerms; i > 0; --i) sum = 1 + x / i * sum;
  for (; k > 0; --k) sum = sum * sum;
  return sum;
}

/// Returns the exponential of a symmetric matrix, computed as in exp_scalar(). The matrix is halved
/// until its largest absolute row sum is at most kMaxExpArgument.
PM_HD inline Sym3d exp_symmetric(Sym3d a) {
  const auto absolute_sum = [](double x, double y, double z) {
    return (x < 0 ? -x : x) + (y < 0 ? -y : y) + (z < 0 ? -z : z);
  };
  const double rows[3] = {absolute_sum(a.xx, a.xy, a.xz), absolute_sum(a.xy, a.yy, a.yz),
                          absolute_sum(a.xz, a.yz, a.zz)};
  double size = rows[0] > rows[1] ? rows[0] : rows[1];
  if (rows[2] > size) size = rows[2];
  int k = 0;
  double scale = 1;
  for (; size > kMaxExpArgument && k < 64; size /= 2) ++k, scale /= 2;
  a = a * scale;
  const Sym3d identity = {1, 1, 1, 0, 0, 0};
  Sym3d sum = identity;
  for (int i = kExpTerms; i > 0; --i) sum = identity + commuting_product(a, sum) * (1.0 / i);
  for (; k > 0; --k) sum = commuting_product(sum, sum);
  return sum;
}

/// Returns the rotation about `axis_times_angle` (Rodrigues), for angles up to 8 radians. Sine and
/// cosine are series at a 16th of the angle, which is then doubled four times.
PM_HD inline Mat3 exp_rotation(Vec3d axis_times_angle) {
  const double angle = length(axis_times_angle);
  if (!(angle > 0)) return {};
  const double x = angle / 16, x2 = x * x;
  double sine = 1, cosine = 1;
  for (int i = 14; i > 0; i -= 2) {
    sine = 1 - x2 / (i * (i + 1)) * sine;
    cosine = 1 - x2 / (i * (i - 1)) * cosine;
  }
  sine = x * sine;
  for (int i = 0; i < 4; ++i) {
    const double twice = 2 * sine * cosine;
    cosine = 1 - 2 * sine * sine;
    sine = twice;
  }
  const Vec3d a = axis_times_angle * (1 / angle);
  const Vec3d v = a * (1 - cosine), s = a * sine;
  return {{cosine + a.x * v.x, a.x * v.y - s.z, a.x * v.z + s.y, a.y * v.x + s.z,
           cosine + a.y * v.y, a.y * v.z - s.x, a.z * v.x - s.y, a.z * v.y + s.x,
           cosine + a.z * v.z}};
}

/// Returns the cube root of v > 0 that is not denormal: a first guess from a third of the exponent,
/// then Newton's method.
PM_HD inline double cube_root(double v) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &v, sizeof bits);
  bits = bits / 3 + 0x2a9f7893782da1ceull;  // the guess is off by 5 % at most (Kahan)
  double root = 0;
  std::memcpy(&root, &bits, sizeof root);
  for (int i = 0; i < 5; ++i) root = root - (root - v / (root * root)) / 3;
  return root;
}

}  // namespace polymorph
