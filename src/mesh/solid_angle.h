// Solid angles of triangles (Van Oosterom and Strackee 1983), as complex numbers.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "base/exact_math.h"
#include "kernels/linear.h"

namespace polymorph {

/// Half the signed solid angle of triangle abc seen from the origin is atan2(num, den). It is
/// positive if abc is counter-clockwise seen from the far side, i.e. from outside a solid around
/// the origin.
struct HalfAngle {
  double num = 0, den = 0;
};

inline HalfAngle half_solid_angle(Vec3d a, Vec3d b, Vec3d c) {
  const double la = length(a), lb = length(b), lc = length(c);
  return {dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb};
}

/// Sums half solid angles of triangles, eight at a time. Angles in (-pi, pi] are represented as
/// complex numbers and multiplied, so that one atan2 suffices for the whole sum.
class AngleSums {
 public:
  static constexpr int kLanes = 8;
  /// Corners of eight triangles: corner[3 * i + axis][k] is a coordinate of corner i of triangle k.
  /// Unused lanes repeat one point.
  struct Triangles {
    float corner[9][kLanes];
  };

  /// Half solid angles of eight triangles. They can be added to several sums, each with its own
  /// mask.
  struct Angles {
    double num[kLanes], den[kLanes];
  };
  static Angles angles(const Triangles& triangles, Vec3d eye) {
    const auto& p = triangles.corner;
    Angles angles;
    for (int k = 0; k < kLanes; ++k) {
      const HalfAngle angle = half_solid_angle(
          {static_cast<double>(p[0][k]) - eye.x, static_cast<double>(p[1][k]) - eye.y,
           static_cast<double>(p[2][k]) - eye.z},
          {static_cast<double>(p[3][k]) - eye.x, static_cast<double>(p[4][k]) - eye.y,
           static_cast<double>(p[5][k]) - eye.z},
          {static_cast<double>(p[6][k]) - eye.x, static_cast<double>(p[7][k]) - eye.y,
           static_cast<double>(p[8][k]) - eye.z});
      angles.num[k] = angle.num;
      angles.den[k] = angle.den;
    }
    return angles;
  }

  /// Adds the angles of the triangles whose bit is set in `mask`.
  void add(const Angles& angles, unsigned mask = (1u << kLanes) - 1) {
    bool is_large_or_small = false;
    for (int first = 0; first < kLanes; first += kWidth) {
      Doubles num, den, re, im, turns;
      Integers bits;
      for (int k = 0; k < kWidth; ++k) bits[k] = std::int64_t{mask >> (first + k) & 1u};
      std::memcpy(&num, angles.num + first, sizeof num);
      std::memcpy(&den, angles.den + first, sizeof den);
      std::memcpy(&re, re_ + first, sizeof re);
      std::memcpy(&im, im_ + first, sizeof im);
      std::memcpy(&turns, turns_ + first, sizeof turns);
      // A triangle with a corner at the eye adds nothing.
      const Integers is_added = (bits != 0) & ((num != 0.0) | (den != 0.0));
      const Doubles factor_re = is_added ? den : ones(), factor_im = is_added ? num : zero();
      const Doubles new_re = re * factor_re - im * factor_im,
                    new_im = im * factor_re + re * factor_im;
      // Count full turns as add_angle() does.
      turns += ((im >= 0.0) & (factor_im >= 0.0) & (new_im < 0.0)) ? ones() : zero();
      turns -= ((im < 0.0) & (factor_im < 0.0) & (new_im >= 0.0)) ? ones() : zero();
      const Doubles size = (new_re < 0.0 ? -new_re : new_re) + (new_im < 0.0 ? -new_im : new_im);
      const Integers is_out_of_range = (size < 1e-100) | (size > 1e100);
      for (int k = 0; k < kWidth; ++k) is_large_or_small |= is_out_of_range[k] != 0;
      std::memcpy(re_ + first, &new_re, sizeof re);
      std::memcpy(im_ + first, &new_im, sizeof im);
      std::memcpy(turns_ + first, &turns, sizeof turns);
    }
    if (is_large_or_small) rescale();
  }
  void add(const Triangles& triangles, Vec3d eye) { add(angles(triangles, eye)); }

  /// The sum of the half solid angles, in radians.
  double sum() const {
    AngleSums product = *this;
    product.rescale();
    for (int k = 1; k < kLanes; ++k)
      add_angle(product.re_[0], product.im_[0], product.re_[k], product.im_[k], product.turns_[0]);
    double turns = 0;
    for (const double lane : product.turns_) turns += lane;
    return turns * (2 * exact::kPi) + exact::atan2(product.im_[0], product.re_[0]);
  }

 private:
  // Explicit vectors (GCC and Clang), because neither compiler vectorizes these comparisons itself.
  static constexpr int kWidth = 4;
  using Doubles [[gnu::vector_size(kWidth * sizeof(double))]] = double;
  using Integers [[gnu::vector_size(kWidth * sizeof(double))]] = std::int64_t;
  static Doubles zero() { return Doubles{}; }
  static Doubles ones() { return Doubles{1, 1, 1, 1}; }

  /// Adds the angle of a factor to that of a complex number; counts full turns when the sum leaves
  /// (-pi, pi].
  static void add_angle(double& re, double& im, double factor_re, double factor_im, double& turns) {
    const double new_re = re * factor_re - im * factor_im, new_im = im * factor_re + re * factor_im;
    // Both angles are in [0, pi] and the sine of their sum is negative, so the sum exceeds pi. The
    // next line is its mirror image.
    if (im >= 0 && factor_im >= 0 && new_im < 0) ++turns;
    if (im < 0 && factor_im < 0 && new_im >= 0) --turns;
    re = new_re;
    im = new_im;
  }
  /// Normalizes the products before they overflow or underflow.
  void rescale() {
    for (int k = 0; k < kLanes; ++k) {
      const double size = std::abs(re_[k]) + std::abs(im_[k]);
      re_[k] /= size;
      im_[k] /= size;
    }
  }

  double re_[kLanes] = {1, 1, 1, 1, 1, 1, 1, 1}, im_[kLanes] = {};
  double turns_[kLanes] = {};
};

}  // namespace polymorph
