// Metaball field functions (Gaussian, Wyvill, inverse square): the contribution of one ball at a
// point, and the ball in the form in which the kernels read it.
//
// A ball maps a point to u = M (point - center). M is upper triangular, and M^T M is the ball's
// matrix; for a round ball M is one number. The ball's coordinate at the point is q = base + u.z^2
// + u.y^2 + u.x^2, a chain of fma's in this order. The ball contributes a function of q, which
// decreases with q (increases for w < 0) and is exactly 0 where q > limit.
//
// Each step of the chain rounds monotonically in each argument, and so does each u_k in each
// coordinate of the point. So q is monotone even after rounding, and the corners of a box bound
// every q that is computed in it, which makes culling exact (tree.h).
//
// V is float, or a pack of floats (simd_math.h): the same operations on several points at once.
#pragma once

#include <cstdint>
#include <type_traits>

#include "field_kinds.h"
#include "host_device.h"
#include "simd_math.h"
#include "types.h"

namespace polymorph {

constexpr int kBatch = 4;  ///< balls that share one division (sum_of_batch)

/// Points, or vectors at points, one per lane of V.
template <class V>
struct Points {
  V x, y, z;
};

/// Bounds of q over a box: no q computed at a point of the box is below `near` or above `far`.
/// Where coordinates overflow, `near` is `base` and `far` may be anything.
template <class V>
struct QRange {
  V near, far;
};

/// Returns the smallest absolute value in [low, high]; furthest() returns the largest.
template <class V>
PM_HD inline V nearest(V low, V high) {
  return max(max(low, -high), broadcast<V>(0.0f));
}
template <class V>
PM_HD inline V furthest(V low, V high) {
  return max(high, -low);
}

/// Ranges over a box: of u, or of the points' own coordinates.
template <class V>
struct CoordinateRange {
  V low_x, high_x, low_y, high_y, low_z, high_z;
};

/// Returns the range of q over a box from the range of u.
template <class V>
PM_HD inline QRange<V> q_range(const CoordinateRange<V>& u, float base) {
  const V nx = nearest(u.low_x, u.high_x), ny = nearest(u.low_y, u.high_y),
          nz = nearest(u.low_z, u.high_z);
  const V fx = furthest(u.low_x, u.high_x), fy = furthest(u.low_y, u.high_y),
          fz = furthest(u.low_z, u.high_z);
  const V b = broadcast<V>(base);
  return {fma(nx, nx, fma(ny, ny, fma(nz, nz, b))), fma(fx, fx, fma(fy, fy, fma(fz, fz, b)))};
}

/// A round ball as the kernels read it; 32 bytes, one aligned load.
struct alignas(32) RoundBall {
  float x = 0, y = 0, z = 0;
  float scale = 1;            ///< u = scale (point - center)
  float base = 0, limit = 0;  ///< q = base + |u|^2; the ball contributes 0 where q > limit
  float w = 0;                ///< unused if Kind::kExponential
  float scale_squared = 1;    ///< scale^2

  template <class V>
  PM_HD V q(V px, V py, V pz) const {
    const V ux = scale * (px - x), uy = scale * (py - y), uz = scale * (pz - z);
    return fma(ux, ux, fma(uy, uy, fma(uz, uz, broadcast<V>(base))));
  }
  /// Computes q of N rows of points, which share x and z, so that the terms in x and z are computed
  /// once. Y is float if a row has one y, V if each lane has its own.
  template <class V, class Y, int N>
  PM_HD void q_rows(V px, const Y (&py)[N], float pz, V (&out)[N]) const {
    const V ux = scale * (px - x);
    const float uz = scale * (pz - z), q0 = fma(uz, uz, base);
    for (int r = 0; r < N; ++r) {
      const Y uy = scale * (py[r] - y);
      out[r] = fma(ux, ux, spread<V>(fma(uy, uy, broadcast<Y>(q0))));
    }
  }
  /// Returns half the gradient of q.
  template <class V>
  PM_HD Points<V> half_gradient_of_q(const Points<V>& p) const {
    return {scale_squared * (p.x - x), scale_squared * (p.y - y), scale_squared * (p.z - z)};
  }
  /// Returns the range of q over the points of a box.
  template <class V>
  PM_HD QRange<V> range(const CoordinateRange<V>& p) const {
    return q_range<V>({scale * (p.low_x - x), scale * (p.high_x - x), scale * (p.low_y - y),
                       scale * (p.high_y - y), scale * (p.low_z - z), scale * (p.high_z - z)},
                      base);
  }
};

/// An ellipsoid as the kernels read it. If a set has an ellipsoid, its round balls have this type,
/// too. Functions are as in RoundBall.
struct alignas(16) EllipsoidBall {
  float x = 0, y = 0, z = 0;
  float base = 0, limit = 0;
  float w = 0;
  float xx = 1, xy = 0, xz = 0, yy = 1, yz = 0, zz = 1;  ///< M; the diagonal is positive

  template <class V>
  PM_HD V q(V px, V py, V pz) const {
    const V dx = px - x, dy = py - y, dz = pz - z;
    const V ux = along_x(dx, dy, dz), uy = along_y(dy, dz), uz = zz * dz;
    return fma(ux, ux, fma(uy, uy, fma(uz, uz, broadcast<V>(base))));
  }
  template <class V, class Y, int N>
  PM_HD void q_rows(V px, const Y (&py)[N], float pz, V (&out)[N]) const {
    const V dx = px - x;
    const float dz = pz - z, uz = zz * dz, q0 = fma(uz, uz, base);
    for (int r = 0; r < N; ++r) {
      const Y dy = py[r] - y, uy = fma(broadcast<Y>(yy), dy, broadcast<Y>(yz * dz));
      const Y row_term = fma(broadcast<Y>(xy), dy, broadcast<Y>(xz * dz));
      const V ux = fma(broadcast<V>(xx), dx, spread<V>(row_term));
      out[r] = fma(ux, ux, spread<V>(fma(uy, uy, broadcast<Y>(q0))));
    }
  }
  template <class V>
  PM_HD Points<V> half_gradient_of_q(const Points<V>& p) const {
    const V dx = p.x - x, dy = p.y - y, dz = p.z - z;
    const V ux = along_x(dx, dy, dz), uy = along_y(dy, dz), uz = zz * dz;
    return {xx * ux, fma(broadcast<V>(yy), uy, xy * ux),
            fma(broadcast<V>(zz), uz, fma(broadcast<V>(yz), uy, xz * ux))};
  }
  template <class V>
  PM_HD QRange<V> range(const CoordinateRange<V>& p) const {
    const V ax = p.low_x - x, bx = p.high_x - x, ay = p.low_y - y, by = p.high_y - y,
            az = p.low_z - z, bz = p.high_z - z;
    // u_k is smallest at a corner given by the signs in row k of M, and largest at the opposite
    // one.
    const bool xy_negative = xy < 0, xz_negative = xz < 0, yz_negative = yz < 0;
    return q_range<V>(
        {along_x(ax, xy_negative ? by : ay, xz_negative ? bz : az),
         along_x(bx, xy_negative ? ay : by, xz_negative ? az : bz),
         along_y(ay, yz_negative ? bz : az), along_y(by, yz_negative ? az : bz), zz * az, zz * bz},
        base);
  }

  /// Returns u along x for the offset d from the centre; along z, u is zz dz.
  template <class V>
  PM_HD V along_x(V dx, V dy, V dz) const {
    return fma(broadcast<V>(xx), dx, fma(broadcast<V>(xy), dy, xz * dz));
  }
  template <class V>
  PM_HD V along_y(V dy, V dz) const {
    return fma(broadcast<V>(yy), dy, yz * dz);
  }
};

/// Minimum ratio of a pivot to its diagonal entry in a positive definite shape: some ten times the
/// rounding error of the entries. Axes may differ by a factor of 1000.
constexpr double kMinPivot = 1e-6;

/// Computes the upper Cholesky factor M of a shape times `scale` (scale * s = M^T M), as xx, xy,
/// xz, yy, yz, zz. Returns false if the matrix is not positive definite (kMinPivot).
PM_HD inline bool factor_shape(const Sym3& s, double scale, double (&m)[6]) {
  const double xx = scale * static_cast<double>(s.xx), yy = scale * static_cast<double>(s.yy),
               zz = scale * static_cast<double>(s.zz);
  if (!(xx > 0 && yy > 0 && zz > 0)) return false;
  m[0] = sqrt(xx);
  m[1] = scale * static_cast<double>(s.xy) / m[0];
  m[2] = scale * static_cast<double>(s.xz) / m[0];
  const double y2 = yy - m[1] * m[1];
  if (!(y2 > kMinPivot * yy)) return false;
  m[3] = sqrt(y2);
  m[4] = (scale * static_cast<double>(s.yz) - m[1] * m[2]) / m[3];
  const double z2 = zz - m[2] * m[2] - m[4] * m[4];
  if (!(z2 > kMinPivot * zz)) return false;
  m[5] = sqrt(z2);
  return true;
}

/// Tests whether a ball of infinite support is too near a box for a polynomial (far_field.h), i.e.
/// whether q.near^3 <= reach |w|. A ball whose q reaches kMaxDistance2 in the box is near, too,
/// because no polynomial follows the kink of the clamp. `reach`: Level::reach.
template <class V>
PM_HD inline auto is_near(V w, QRange<V> q, float reach) {
  return (q.near * (q.near * q.near) <= reach * max(w, -w)) | (q.far >= kMaxDistance2);
}

/// Returns the factor of one axis in a ball's value in a separable field; u2 is u^2 along the axis,
/// plus base along x. Within the ball's support u2 <= kMaxAxisExponent (GaussianField::prepare);
/// beyond it the factor is not used.
template <class V>
PM_HD inline V separable_factor(V u2) {
  return exp2(-min(u2, broadcast<V>(kMaxAxisExponent)));
}

/// A field function (field_kinds.h) with a type of balls. The passes are compiled for each Field.
template <class KindType, class BallType>
struct Field {
  using Ball = BallType;
  using Kind = KindType;
  /// True if balls have finite support. Otherwise far_field.h sums the distant balls, and sums take
  /// four balls at a time (sum_of_batch).
  static constexpr bool kCompactSupport = Kind::kCompactSupport;
  /// True if a contribution is a product of one factor per axis; the points of a grid share
  /// factors.
  static constexpr bool kSeparable = Kind::kExponential && std::is_same<Ball, RoundBall>::value;

  /// Tests whether a ball belongs in the list of a node. `q`: range of the ball's coordinate over
  /// the node's box; `reach`: Level::reach.
  template <class V>
  PM_HD static auto reaches(const Ball& ball, QRange<V> q, float reach) {
    if constexpr (kCompactSupport) {
      return q.near <= ball.limit;
    } else {
      return is_near(broadcast<V>(ball.w), q, reach);
    }
  }

  /// Returns the contribution of a ball at the coordinate q.
  template <class V>
  PM_HD static V value(const Ball& ball, V q) {
    return Kind::value(ball, q);
  }
  /// Returns -d value / dq, up to a positive factor common to all balls.
  template <class V>
  PM_HD static V negated_derivative(const Ball& ball, V q) {
    return Kind::negated_derivative(ball, q);
  }
};

/// Stores M, the Cholesky factor of the matrix scale * shape, in a ball.
PM_HD inline void set_matrix(RoundBall& ball, const Sym3&, double scale) {
  ball.scale = static_cast<float>(sqrt(scale));
  ball.scale_squared = static_cast<float>(scale);
}
PM_HD inline void set_matrix(EllipsoidBall& ball, const Sym3& shape, double scale) {
  double m[6] = {1, 0, 0, 1, 0, 1};
  factor_shape(shape, scale, m);  // succeeds, because validate.h rejects other shapes
  ball.xx = static_cast<float>(m[0]), ball.xy = static_cast<float>(m[1]);
  ball.xz = static_cast<float>(m[2]), ball.yy = static_cast<float>(m[3]);
  ball.yz = static_cast<float>(m[4]), ball.zz = static_cast<float>(m[5]);
}

/// Loads four balls, those of the first indices in `list`. If only `remaining` < 4 are left, balls
/// of weight 0 take the other places.
PM_HD inline void load_batch(const RoundBall* balls, const std::uint32_t* list,
                             std::uint32_t remaining, RoundBall (&out)[kBatch]) {
  for (std::uint32_t i = 0; i < kBatch; ++i) {
    RoundBall padding;
    padding.scale = 0, padding.base = 1;  // q is 1 everywhere, so that no division is by 0
    out[i] = i < remaining ? balls[list[i]] : padding;
  }
}

/// Returns w0 / q0 + w1 / q1 + w2 / q2 + w3 / q3, computed with one division.
template <class BallType, class V>
PM_HD inline V sum_of_batch(const BallType (&b)[kBatch], const V (&q)[kBatch]) {
  const V n01 = fma(broadcast<V>(b[0].w), q[1], b[1].w * q[0]), d01 = q[0] * q[1];
  const V n23 = fma(broadcast<V>(b[2].w), q[3], b[3].w * q[2]), d23 = q[2] * q[3];
  return fma(n01, d23, n23 * d01) / (d01 * d23);
}

/// Returns `sum` plus a ball's contribution in a separable field, with the same bits as in
/// bricks.h.
template <class V>
PM_HD inline V add_product(V sum, const RoundBall& ball, V x, V y, V z) {
  const V ux = ball.scale * (x - ball.x), uy = ball.scale * (y - ball.y),
          uz = ball.scale * (z - ball.z);
  const V along_x = separable_factor(fma(ux, ux, broadcast<V>(ball.base)));
  return fma(zero_unless(ball.q(x, y, z) <= ball.limit, along_x),
             separable_factor(uy * uy) * separable_factor(uz * uz), sum);
}

/// Returns a ball as the kernels read it.
template <class F>
PM_HD inline typename F::Ball prepare_ball(const Ball& ball, FieldScale scale) {
  typename F::Ball out;
  out.x = ball.center.x;
  out.y = ball.center.y;
  out.z = ball.center.z;
  out.w = ball.w;
  const double matrix_scale = F::Kind::prepare(ball, scale, out);
  set_matrix(out, ball.shape, matrix_scale);
  return out;
}

}  // namespace polymorph
