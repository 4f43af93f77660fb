// Solid angle of a triangle (Van Oosterom and Strackee 1983), as a complex number.
#pragma once

#include <algorithm>

#include "base/exact_math.h"
#include "kernels/linear.h"

namespace polymorph {

/// Half the signed solid angle of triangle abc seen from the origin is atan2(num, den) (van
/// Oosterom and Strackee 1983); positive when abc turns counter-clockwise seen from the far side,
/// i.e. from outside a solid around the origin.
struct HalfAngle {
  double num = 0, den = 0;
};

inline HalfAngle half_solid_angle(Vec3d a, Vec3d b, Vec3d c) {
  const double la = length(a), lb = length(b), lc = length(c);
  return {dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb};
}

/// Sums half solid angles of triangles, eight at a time: the angles in (-pi, pi] are multiplied as
/// complex numbers, so that one atan2 is enough for all.
class AngleSums {
 public:
  static constexpr int kLanes = 8;
  /// The corners of eight triangles, by coordinate (9) and triangle; places without a triangle
  /// repeat one point.
  struct Triangles {
    float corner[9][kLanes];
  };

  void add(const Triangles& triangles, Vec3d eye) {
    const auto& p = triangles.corner;
    double num[kLanes], den[kLanes];
    for (int k = 0; k < kLanes; ++k) {
      const HalfAngle angle = half_solid_angle(
          {static_cast<double>(p[0][k]) - eye.x, static_cast<double>(p[1][k]) - eye.y,
           static_cast<double>(p[2][k]) - eye.z},
          {static_cast<double>(p[3][k]) - eye.x, static_cast<double>(p[4][k]) - eye.y,
           static_cast<double>(p[5][k]) - eye.z},
          {static_cast<double>(p[6][k]) - eye.x, static_cast<double>(p[7][k]) - eye.y,
           static_cast<double>(p[8][k]) - eye.z});
      num[k] = angle.num;
      den[k] = angle.den;
    }
    double size_low = 1, size_high = 1;
    for (int k = 0; k < kLanes; ++k) {
      if (num[k] == 0 && den[k] == 0) continue;  // the eye is a corner
      const double size = turn(re_[k], im_[k], den[k], num[k], turns_);
      size_low = std::min(size_low, size);
      size_high = std::max(size_high, size);
    }
    if (size_low < 1e-100 || size_high > 1e100) rescale();
  }

  double sum() const {
    AngleSums all = *this;
    all.rescale();
    for (int k = 1; k < kLanes; ++k)
      turn(all.re_[0], all.im_[0], all.re_[k], all.im_[k], all.turns_);
    return all.turns_ * (2 * exact::kPi) + exact::atan2(all.im_[0], all.re_[0]);
  }

 private:
  /// Adds the angle of one complex number to that of another; counts the turns that leave (-pi,
  /// pi]. Returns the product's size.
  static double turn(double& re, double& im, double by_re, double by_im, int& turns) {
    const double new_re = re * by_re - im * by_im, new_im = im * by_re + re * by_im;
    // Both angles in [0, pi] and the sum's sine below 0: it went past pi; likewise below.
    if (im >= 0 && by_im >= 0 && new_im < 0) ++turns;
    if (im < 0 && by_im < 0 && new_im >= 0) --turns;
    re = new_re;
    im = new_im;
    return std::abs(re) + std::abs(im);
  }
  /// Keeps the products in range.
  void rescale() {
    for (int k = 0; k < kLanes; ++k) {
      const double size = std::abs(re_[k]) + std::abs(im_[k]);
      re_[k] /= size;
      im_[k] /= size;
    }
  }

  double re_[kLanes] = {1, 1, 1, 1, 1, 1, 1, 1}, im_[kLanes] = {};
  int turns_ = 0;
};

}  // namespace polymorph
