// Solid angle of a triangle (Van Oosterom and Strackee 1983), as a complex number.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

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

  /// What the triangles add, without the sum: for sums that take some of them several times.
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

  /// Adds the angles of the triangles whose bit is set in `taken`.
  void add(const Angles& angles, unsigned taken = (1u << kLanes) - 1) {
    bool is_large_or_small = false;
    for (int first = 0; first < kLanes; first += kWidth) {
      Doubles num, den, re, im, turns;
      Integers bits;
      for (int k = 0; k < kWidth; ++k) bits[k] = std::int64_t{taken >> (first + k) & 1u};
      std::memcpy(&num, angles.num + first, sizeof num);
      std::memcpy(&den, angles.den + first, sizeof den);
      std::memcpy(&re, re_ + first, sizeof re);
      std::memcpy(&im, im_ + first, sizeof im);
      std::memcpy(&turns, turns_ + first, sizeof turns);
      // Nothing where the eye is a corner.
      const Integers adds = (bits != 0) & ((num != 0.0) | (den != 0.0));
      const Doubles by_re = adds ? den : one(), by_im = adds ? num : zero();
      const Doubles new_re = re * by_re - im * by_im, new_im = im * by_re + re * by_im;
      // As in turn().
      turns += ((im >= 0.0) & (by_im >= 0.0) & (new_im < 0.0)) ? one() : zero();
      turns -= ((im < 0.0) & (by_im < 0.0) & (new_im >= 0.0)) ? one() : zero();
      const Doubles size = (new_re < 0.0 ? -new_re : new_re) + (new_im < 0.0 ? -new_im : new_im);
      const Integers out = (size < 1e-100) | (size > 1e100);
      for (int k = 0; k < kWidth; ++k) is_large_or_small |= out[k] != 0;
      std::memcpy(re_ + first, &new_re, sizeof re);
      std::memcpy(im_ + first, &new_im, sizeof im);
      std::memcpy(turns_ + first, &turns, sizeof turns);
    }
    if (is_large_or_small) rescale();
  }
  void add(const Triangles& triangles, Vec3d eye) { add(angles(triangles, eye)); }

  double sum() const {
    AngleSums all = *this;
    all.rescale();
    for (int k = 1; k < kLanes; ++k)
      turn(all.re_[0], all.im_[0], all.re_[k], all.im_[k], all.turns_[0]);
    double turns = 0;
    for (const double lane : all.turns_) turns += lane;
    return turns * (2 * exact::kPi) + exact::atan2(all.im_[0], all.re_[0]);
  }

 private:
  // Vectors of both compilers, because neither makes them of these comparisons by itself.
  static constexpr int kWidth = 4;
  using Doubles [[gnu::vector_size(kWidth * sizeof(double))]] = double;
  using Integers [[gnu::vector_size(kWidth * sizeof(double))]] = std::int64_t;
  static Doubles zero() { return Doubles{}; }
  static Doubles one() { return Doubles{1, 1, 1, 1}; }

  /// Adds the angle of one complex number to that of another; counts the turns that leave (-pi,
  /// pi].
  static void turn(double& re, double& im, double by_re, double by_im, double& turns) {
    const double new_re = re * by_re - im * by_im, new_im = im * by_re + re * by_im;
    // Both angles in [0, pi] and the sum's sine below 0: it went past pi; likewise below.
    if (im >= 0 && by_im >= 0 && new_im < 0) ++turns;
    if (im < 0 && by_im < 0 && new_im >= 0) --turns;
    re = new_re;
    im = new_im;
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
  double turns_[kLanes] = {};
};

}  // namespace polymorph
