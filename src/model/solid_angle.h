// Solid angle of a triangle (Van Oosterom and Strackee 1983), as a complex number.
#pragma once

#include <algorithm>

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
/// complex numbers, so that one atan2 a lane is enough for all of them.
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
      const double re = re_[k] * den[k] - im_[k] * num[k], im = re_[k] * num[k] + im_[k] * den[k];
      // Both angles in [0, pi] and the sum's sine below 0: it went past pi; likewise below.
      if (im_[k] >= 0 && num[k] >= 0 && im < 0) ++turns_;
      if (im_[k] < 0 && num[k] < 0 && im >= 0) --turns_;
      re_[k] = re;
      im_[k] = im;
      const double size = std::abs(re) + std::abs(im);
      size_low = std::min(size_low, size);
      size_high = std::max(size_high, size);
    }
    if (size_low < 1e-100 || size_high > 1e100) rescale();
  }

  double sum() const {
    double sum = turns_ * 6.283185307179586;
    // + 0.0 makes -0 a 0, which atan2 tells apart.
    for (int k = 0; k < kLanes; ++k) sum += std::atan2(im_[k] + 0.0, re_[k]);
    return sum;
  }

 private:
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
