// Solid angles of triangles (Van Oosterom and Strackee 1983), as complex numbers.
#pragma once

#include <cmath>
#include <cstdint>

#include "base/exact_math.h"
#include "kernels/linear.h"
#include "mesh/four_doubles.h"

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

  /// Half solid angles of eight triangles, seen from a point `apex`. They can be added to several
  /// sums, each with its own mask.
  struct Angles {
    double num[kLanes], den[kLanes];
  };
  static Angles angles(const Triangles& triangles, Vec3d apex) {
    Angles angles;
    for (int first = 0; first < kLanes; first += kWidth) {
      const FourAngles four = four_angles(triangles, first, apex);
      store_four(angles.num + first, four.num);
      store_four(angles.den + first, four.den);
    }
    return angles;
  }

  /// Adds the angles of the triangles whose bit is set in `mask`.
  void add(const Angles& angles, unsigned mask = (1u << kLanes) - 1) {
    unsigned out_of_range = 0;
    for (int first = 0; first < kLanes; first += kWidth) {
      FourIntegers bits;
      for (int k = 0; k < kWidth; ++k) bits[k] = std::int64_t{mask >> (first + k) & 1u};
      out_of_range |= add_four(
          first, {load_four(angles.num + first), load_four(angles.den + first)}, bits != 0);
    }
    if (out_of_range != 0) rescale();
  }
  void add(const Triangles& triangles, Vec3d apex) {
    unsigned out_of_range = 0;
    for (int first = 0; first < kLanes; first += kWidth)
      out_of_range |=
          add_four(first, four_angles(triangles, first, apex), FourIntegers{-1, -1, -1, -1});
    if (out_of_range != 0) rescale();
  }

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
  static constexpr int kWidth = 4;
  static FourDoubles zero() { return FourDoubles{}; }
  static FourDoubles ones() { return FourDoubles{1, 1, 1, 1}; }

  /// Four half solid angles, as HalfAngle.
  struct FourAngles {
    FourDoubles num, den;
  };
  struct FourVectors {
    FourDoubles x, y, z;
  };
  static FourDoubles dot_four(const FourVectors& a, const FourVectors& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
  }
  /// Computes half_solid_angle() of the triangles `first` to `first` + 3.
  static FourAngles four_angles(const Triangles& triangles, int first, Vec3d apex) {
    const auto corner = [&](int i) {
      const auto& p = triangles.corner;
      return FourVectors{load_four(p[3 * i] + first) - apex.x,
                         load_four(p[3 * i + 1] + first) - apex.y,
                         load_four(p[3 * i + 2] + first) - apex.z};
    };
    const FourVectors a = corner(0), b = corner(1), c = corner(2);
    const FourDoubles la = square_roots(dot_four(a, a)), lb = square_roots(dot_four(b, b)),
                      lc = square_roots(dot_four(c, c));
    const FourVectors normal{b.y * c.z - b.z * c.y, b.z * c.x - b.x * c.z, b.x * c.y - b.y * c.x};
    return {dot_four(a, normal),
            la * lb * lc + dot_four(a, b) * lc + dot_four(b, c) * la + dot_four(c, a) * lb};
  }

  /// Multiplies the products of the lanes from `first` on, where `is_taken` is not 0. Returns a
  /// mask that is not 0 if a product is to be rescaled.
  unsigned add_four(int first, const FourAngles& angles, FourIntegers is_taken) {
    const auto& [num, den] = angles;
    const FourDoubles re = load_four(re_ + first), im = load_four(im_ + first);
    FourDoubles turns = load_four(turns_ + first);
    // A triangle with a corner at the apex adds nothing.
    const FourIntegers is_added = is_taken & ((num != 0.0) | (den != 0.0));
    const FourDoubles factor_re = is_added ? den : ones(), factor_im = is_added ? num : zero();
    const FourDoubles new_re = re * factor_re - im * factor_im,
                      new_im = im * factor_re + re * factor_im;
    // Count full turns as add_angle() does.
    turns += ((im >= 0.0) & (factor_im >= 0.0) & (new_im < 0.0)) ? ones() : zero();
    turns -= ((im < 0.0) & (factor_im < 0.0) & (new_im >= 0.0)) ? ones() : zero();
    const FourDoubles size = (new_re < 0.0 ? -new_re : new_re) + (new_im < 0.0 ? -new_im : new_im);
    store_four(re_ + first, new_re);
    store_four(im_ + first, new_im);
    store_four(turns_ + first, turns);
    return mask_of((size < 1e-100) | (size > 1e100));
  }

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

  /// Per lane: the product of the angles' complex numbers, and the full turns by which the sum of
  /// the angles differs from the product's angle.
  double re_[kLanes] = {1, 1, 1, 1, 1, 1, 1, 1}, im_[kLanes] = {};
  double turns_[kLanes] = {};
};

}  // namespace polymorph
