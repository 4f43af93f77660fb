// The angle under which a triangle is seen, as a complex number.
#pragma once

#include "model/vec3d.h"

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

/// Sums angles in (-pi, pi] as a product of complex numbers, so that one atan2 is enough for all.
class AngleSum {
 public:
  void add(HalfAngle angle) {
    if (angle.num == 0 && angle.den == 0) return;  // the eye is a corner
    const double re = re_ * angle.den - im_ * angle.num, im = re_ * angle.num + im_ * angle.den;
    // Both angles in [0, pi] and the sum's sine below 0: it went past pi; likewise below.
    if (im_ >= 0 && angle.num >= 0 && im < 0) ++turns_;
    if (im_ < 0 && angle.num < 0 && im >= 0) --turns_;
    re_ = re;
    im_ = im;
  }
  /// Keeps the product in range; call every few adds.
  void rescale() {
    const double size = std::abs(re_) + std::abs(im_);
    if (size < 1e-100 || size > 1e100) {
      re_ /= size;
      im_ /= size;
    }
  }
  // + 0.0 makes -0 a 0, which atan2 tells apart.
  double sum() const { return std::atan2(im_ + 0.0, re_) + turns_ * 6.283185307179586; }

 private:
  double re_ = 1, im_ = 0;
  int turns_ = 0;
};

}  // namespace polymorph
