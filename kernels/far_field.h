// Far-field approximation of a field with infinite support (as in a fast multipole method): the sum
// of distant balls within a node of the tree, taken at 4^3 Chebyshev points of the node's box and
// interpolated between them by a polynomial of third degree along each axis. Nearer balls stay in
// the node's list and are summed one by one.
//
// Each level passes its polynomial on to the next: a child evaluates its parent's polynomial at its
// own points (restricted to a smaller box it is the same polynomial, so this costs only rounding)
// and adds the balls of its parent's list that are distant from the smaller box
// (expand_far_field.h). So for a brick each ball counts exactly once: in an ancestor's polynomial
// or in the list.
//
// Error bound: along an axis w / q has derivatives of order n of at most
// n! (n + 1) |w| / q^(n / 2 + 1), since the expansion of 1 / q has Chebyshev polynomials of the
// second kind as its coefficients and |U_n| <= n + 1. Interpolation in 4 Chebyshev points over half
// a side `a` is off by at most a^4 / 8 times the fourth derivative / 4!, which is 5/8 |w| a^4 /
// near^3, where near is the smallest q in the box. Along three axes the error is 1 + L + L^2 = 6.27
// times as large, with L = 1.848 the Lebesgue constant of 4 points. A ball is distant if this bound
// is below a tolerance. FarField::error is the sum of the bounds. A value that is nearer to iso
// than this error plus the rounding error is replaced by the exact sum over all balls (bricks.h).
// So all bricks agree on which points are inside.
//
// Why interpolation, and not a Taylor series about the middle: the 64 values are about as accurate
// as the 56 coefficients of a series of fifth degree. At the worst point of a box whose half side
// is 1/4 of the ball's distance, the error is 0.26 % of the ball's value against 0.21 %, and 0.75 %
// with the 35 coefficients of fourth degree. Moreover, one thread sums each value in the order of
// the list, and children only have to evaluate the polynomial.
#pragma once

#include "host_device.h"
#include "simd_math.h"
#include "types.h"

namespace polymorph {

constexpr int kFarAlong = 4;  ///< points along an axis
constexpr int kFarPoints = kFarAlong * kFarAlong * kFarAlong;
constexpr float kFarError = 3.93f;  ///< 5/8 (1 + L + L^2), and rounding

/// Maximum error of a distant ball, in units of iso * cell / FieldScale::length. A field falls from
/// iso by about this unit over one cell, so the error shifts the surface by this fraction of a
/// cell. Measured on 1032 balls (bench) at 256^3: with 1e-3 vertices are off by 3.7e-4 cells rms
/// (8.5e-4 for the worst in 1000) and the surface takes 0.8 times as long; with 2e-4 by 1.6e-4
/// (1.9e-4); with 1e-4 by 0.9e-4 (1.3e-4), and 1.15 times as long.
constexpr float kFarTolerance = 2e-4f;

/// The points' coordinates in half sides, cos(pi / 8) and cos(3 pi / 8), and their squares.
constexpr float kFarOuter = 0.92387953f, kFarInner = 0.38268343f;
constexpr float kFarOuter2 = 0.85355339f, kFarInner2 = 0.14644661f;
PM_HD constexpr float far_point(int i) {
  return i == 0 ? -kFarOuter : i == 1 ? -kFarInner : i == 2 ? kFarInner : kFarOuter;
}

/// The far field of one node; FarField{} is 0. Sums are over the distant balls; `near` is the
/// smallest q of a ball in the node's box.
struct FarField {
  float value[kFarPoints];        ///< values of the polynomial at the points, x fastest
  float error;                    ///< bound of the polynomial's error anywhere in the box
  float rounding;                 ///< bound of its rounding, far below `error`
  float second_derivative_bound;  ///< sum of 3 |w| / near^2: half a bound of the second derivative
  float magnitude;                ///< sum of |w| / near
  float negative_weight_bound;  ///< sum of |w| / near over the balls of the node's list with w < 0
};

/// The box in which a polynomial is used.
struct FarBox {
  Vec3 middle, half, inverse;  ///< half: half the sides; inverse: 1 / half

  FarBox() = default;
  PM_HD FarBox(Vec3 low, Vec3 high)
      : middle(0.5f * low + 0.5f * high),
        half(0.5f * high - 0.5f * low),
        inverse{1.0f / half.x, 1.0f / half.y, 1.0f / half.z} {}
};

/// Lagrange weights of the 4 points at s in [-1, 1]: polynomials that are 1 at one point and 0 at
/// the others.
template <class V>
struct FarWeights {
  V at[kFarAlong];

  /// 1 / (2 kFarOuter d) and 1 / (2 kFarInner d), where d = kFarOuter2 - kFarInner2.
  static constexpr float kOuterScale = 0.76536686f, kInnerScale = 1.84775907f;

  PM_HD explicit FarWeights(V s) {
    const V s2 = s * s, outer = kOuterScale * (s2 - kFarInner2),
            inner = kInnerScale * (s2 - kFarOuter2);
    at[0] = outer * (kFarOuter - s), at[1] = inner * (s - kFarInner);
    at[2] = inner * (-kFarInner - s), at[3] = outer * (kFarOuter + s);
  }
  /// Computes the weights and, in `slope`, their derivatives.
  PM_HD FarWeights(V s, V (&slope)[kFarAlong]) : FarWeights(s) {
    const V outer = s * s - kFarInner2, inner = s * s - kFarOuter2, twice = s + s;
    slope[0] = kOuterScale * fma(twice, kFarOuter - s, -outer);
    slope[1] = kInnerScale * fma(twice, s - kFarInner, inner);
    slope[2] = kInnerScale * fma(twice, -kFarInner - s, -inner);
    slope[3] = kOuterScale * fma(twice, kFarOuter + s, outer);
  }
};

/// Returns the weighted sum of four values along an axis.
template <class V>
PM_HD inline V far_sum(const V (&weight)[kFarAlong], const float* value) {
  V sum = weight[0] * value[0];
  for (int i = 1; i < kFarAlong; ++i) sum = fma(weight[i], broadcast<V>(value[i]), sum);
  return sum;
}

/// Evaluates the polynomial at a point, whose coordinates are in half sides from the middle.
template <class V>
PM_HD inline V far_value(const float (&value)[kFarPoints], V x, V y, V z) {
  const FarWeights<V> wx(x), wy(y), wz(z);
  V sum = broadcast<V>(0.0f);
  for (int k = 0; k < kFarAlong; ++k) {
    V plane = broadcast<V>(0.0f);
    for (int j = 0; j < kFarAlong; ++j) {
      plane = fma(wy.at[j], far_sum(wx.at, value + kFarAlong * (j + kFarAlong * k)), plane);
    }
    sum = fma(wz.at[k], plane, sum);
  }
  return sum;
}

/// Evaluates the polynomial at N rows of points that share x and z, whose common terms are computed
/// once. Y: as for RoundBall::q_rows().
template <class V, class Y, int N>
PM_HD inline void far_rows(const float (&value)[kFarPoints], const FarBox& box, V x,
                           const Y (&y)[N], float z, V (&out)[N]) {
  constexpr int kPlane = kFarAlong * kFarAlong;
  const FarWeights<float> wz(box.inverse.z * (z - box.middle.z));
  const FarWeights<V> wx(box.inverse.x * (x - box.middle.x));
  float plane[kPlane];
  for (int i = 0; i < kPlane; ++i) plane[i] = wz.at[0] * value[i];
  for (int k = 1; k < kFarAlong; ++k) {
    for (int i = 0; i < kPlane; ++i) plane[i] = fma(wz.at[k], value[kPlane * k + i], plane[i]);
  }
  V line[kFarAlong];
  for (int j = 0; j < kFarAlong; ++j) line[j] = far_sum(wx.at, plane + kFarAlong * j);
  for (int r = 0; r < N; ++r) {
    const FarWeights<Y> wy(box.inverse.y * (y[r] - box.middle.y));
    out[r] = broadcast<V>(0.0f);
    for (int j = 0; j < kFarAlong; ++j) out[r] = fma(spread<V>(wy.at[j]), line[j], out[r]);
  }
}

/// Value and gradient of the polynomial at a point.
template <class V>
struct FarSlope {
  V value, x, y, z;

  PM_HD FarSlope(const float (&values)[kFarPoints], const FarBox& box, V px, V py, V pz)
      : value(broadcast<V>(0.0f)), x(value), y(value), z(value) {
    V sx[kFarAlong], sy[kFarAlong], sz[kFarAlong];
    const FarWeights<V> wx(box.inverse.x * (px - box.middle.x), sx);
    const FarWeights<V> wy(box.inverse.y * (py - box.middle.y), sy);
    const FarWeights<V> wz(box.inverse.z * (pz - box.middle.z), sz);
    for (int k = 0; k < kFarAlong; ++k) {
      V plane = broadcast<V>(0.0f), along_x = plane, along_y = plane;
      for (int j = 0; j < kFarAlong; ++j) {
        const float* row = values + kFarAlong * (j + kFarAlong * k);
        const V sum = far_sum(wx.at, row);
        plane = fma(wy.at[j], sum, plane);
        along_x = fma(wy.at[j], far_sum(sx, row), along_x);
        along_y = fma(sy[j], sum, along_y);
      }
      value = fma(wz.at[k], plane, value);
      x = fma(wz.at[k], along_x, x);
      y = fma(wz.at[k], along_y, y);
      z = fma(sz[k], plane, z);
    }
    x = box.inverse.x * x, y = box.inverse.y * y, z = box.inverse.z * z;
  }
};

}  // namespace polymorph
