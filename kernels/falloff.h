// What one ball contributes at a point, and the ball in the form in which the kernels read it.
//
// A ball maps a point to u = M (point - center), M upper triangular with M^T M its matrix; for a
// round ball M is one number. Its coordinate there is q = base + u.z^2 + u.y^2 + u.x^2, a chain of
// fma's in this order, and what it contributes a function of q that falls with q (rises for w < 0)
// and is exactly 0 where q > limit.
//
// Each step of the chain rounds monotonically in each argument, and so does each u_k in each
// coordinate of the point. Hence the corners of a box bound every q computed for a point of it,
// rounding included: this is what makes culling exact (bricks.h).
//
// V is float, or a pack of floats (math.h): the same operations on several points at once.
#pragma once

#include <cstdint>

#include "host_device.h"
#include "math.h"
#include "types.h"

namespace polymorph {

/// Added to r^2 of kInverseSquare, so that a ball's centre has a finite, large value.
constexpr float kSmallestDistance2 = 1e-20f;

/// Bounds of q over a box: no q computed in it is below `near` or above `far`. Where coordinates
/// overflow, `near` is `base` and `far` may be anything.
template <class V>
struct QRange {
  V near, far;
};

/// The absolute value in [low, high] nearest to 0, and the one furthest from it.
template <class V>
PM_HD inline V nearest(V low, V high) {
  return most(most(low, -high), V{} + 0.0f);
}
template <class V>
PM_HD inline V furthest(V low, V high) {
  return most(high, -low);
}

template <class V>
PM_HD inline QRange<V> q_range(V low_x, V high_x, V low_y, V high_y, V low_z, V high_z,
                               float base) {
  const V nx = nearest(low_x, high_x), ny = nearest(low_y, high_y), nz = nearest(low_z, high_z);
  const V fx = furthest(low_x, high_x), fy = furthest(low_y, high_y), fz = furthest(low_z, high_z);
  const V b = V{} + base;
  return {fused(nx, nx, fused(ny, ny, fused(nz, nz, b))),
          fused(fx, fx, fused(fy, fy, fused(fz, fz, b)))};
}

/// A round ball with its constants folded; 32 bytes: one aligned load.
struct alignas(32) RoundBall {
  float x = 0, y = 0, z = 0;
  float scale = 1;  ///< u = scale (point - center)
  float base = 0, limit = 0;
  float w = 0;     ///< kGaussian: unused
  float rise = 1;  ///< scale^2

  template <class V>
  PM_HD V q(V px, V py, V pz) const {
    const V ux = scale * (px - x), uy = scale * (py - y), uz = scale * (pz - z);
    return fused(ux, ux, fused(uy, uy, fused(uz, uz, V{} + base)));
  }
  /// Half the gradient of q.
  template <class V>
  PM_HD void q_rise(V px, V py, V pz, V& gx, V& gy, V& gz) const {
    gx = rise * (px - x), gy = rise * (py - y), gz = rise * (pz - z);
  }
  template <class V>
  PM_HD QRange<V> range(V lx, V hx, V ly, V hy, V lz, V hz) const {
    return q_range<V>(scale * (lx - x), scale * (hx - x), scale * (ly - y), scale * (hy - y),
                      scale * (lz - z), scale * (hz - z), base);
  }
};

/// An ellipsoid; round balls go this way too where one ball of the set is not.
struct alignas(16) EllipsoidBall {
  float x = 0, y = 0, z = 0;
  float base = 0, limit = 0;
  float w = 0;
  float xx = 1, xy = 0, xz = 0, yy = 1, yz = 0, zz = 1;  ///< M; the diagonal is positive

  template <class V>
  PM_HD V q(V px, V py, V pz) const {
    const V dx = px - x, dy = py - y, dz = pz - z;
    const V ux = along_x(dx, dy, dz), uy = along_y(dy, dz), uz = zz * dz;
    return fused(ux, ux, fused(uy, uy, fused(uz, uz, V{} + base)));
  }
  template <class V>
  PM_HD void q_rise(V px, V py, V pz, V& gx, V& gy, V& gz) const {
    const V dx = px - x, dy = py - y, dz = pz - z;
    const V ux = along_x(dx, dy, dz), uy = along_y(dy, dz), uz = zz * dz;
    gx = xx * ux;
    gy = fused(V{} + yy, uy, xy * ux);
    gz = fused(V{} + zz, uz, fused(V{} + yz, uy, xz * ux));
  }
  template <class V>
  PM_HD QRange<V> range(V lx, V hx, V ly, V hy, V lz, V hz) const {
    const V ax = lx - x, bx = hx - x, ay = ly - y, by = hy - y, az = lz - z, bz = hz - z;
    // u_k is least at the corner that the signs of row k of M pick, and greatest at the other.
    const bool y1 = xy < 0, z1 = xz < 0, z2 = yz < 0;
    return q_range<V>(along_x(ax, y1 ? by : ay, z1 ? bz : az),
                      along_x(bx, y1 ? ay : by, z1 ? az : bz), along_y(ay, z2 ? bz : az),
                      along_y(by, z2 ? az : bz), zz * az, zz * bz, base);
  }

  template <class V>
  PM_HD V along_x(V dx, V dy, V dz) const {
    return fused(V{} + xx, dx, fused(V{} + xy, dy, xz * dz));
  }
  template <class V>
  PM_HD V along_y(V dy, V dz) const {
    return fused(V{} + yy, dy, yz * dz);
  }
};

/// The least ratio of a pivot to its diagonal entry at which a shape counts as positive definite:
/// some ten times the rounding of its entries. Axes may differ by a factor of 1000.
constexpr double kLeastPivot = 1e-6;

/// M of a symmetric matrix: its Cholesky factor (upper; matrix = M^T M). False where the matrix is
/// not positive definite.
PM_HD inline bool factor(const Sym3& s, double by, double (&m)[6]) {
  const double xx = by * static_cast<double>(s.xx), yy = by * static_cast<double>(s.yy),
               zz = by * static_cast<double>(s.zz);
  if (!(xx > 0 && yy > 0 && zz > 0)) return false;
  m[0] = square_root(xx);
  m[1] = by * static_cast<double>(s.xy) / m[0];
  m[2] = by * static_cast<double>(s.xz) / m[0];
  const double y2 = yy - m[1] * m[1];
  if (!(y2 > kLeastPivot * yy)) return false;
  m[3] = square_root(y2);
  m[4] = (by * static_cast<double>(s.yz) - m[1] * m[2]) / m[3];
  const double z2 = zz - m[2] * m[2] - m[4] * m[4];
  if (!(z2 > kLeastPivot * zz)) return false;
  m[5] = square_root(z2);
  return true;
}

/// One field function over balls of one form: what extract() is compiled for.
template <FieldKind kKindOf, class BallType>
struct Field {
  using Ball = BallType;
  static constexpr FieldKind kKind = kKindOf;
  /// Balls end somewhere: lists are culled.
  static constexpr bool kEnds = kKind != FieldKind::kInverseSquare;

  /// What a ball contributes where its coordinate is q.
  template <class V>
  PM_HD static V value(const Ball& ball, V q) {
    if (kKind == FieldKind::kGaussian) return kept_if(q <= ball.limit, power_of_two(-q));
    if (kKind == FieldKind::kWyvill) {
      const V rest = 1.0f - q;
      return kept_if(q <= ball.limit,
                     (ball.w * (rest * rest)) * fused(V{} + -4.0f / 9.0f, q, V{} + 1.0f));
    }
    return ball.w / q;
  }

  /// - d value / dq, up to one positive factor common to all balls.
  template <class V>
  PM_HD static V fall(const Ball& ball, V q) {
    if (kKind == FieldKind::kGaussian) return value(ball, q);
    if (kKind == FieldKind::kWyvill) {
      // (1 - q) (22 - 12 q) / 9 is the derivative; the common 2 / 9 is left out.
      return kept_if(q <= ball.limit, ball.w * ((1.0f - q) * fused(V{} + -6.0f, q, V{} + 11.0f)));
    }
    return ball.w / (q * q);
  }
};

PM_HD inline void set_matrix(RoundBall& ball, const Sym3&, double by) {
  ball.scale = static_cast<float>(square_root(by));
  ball.rise = static_cast<float>(by);
}
PM_HD inline void set_matrix(EllipsoidBall& ball, const Sym3& shape, double by) {
  double m[6] = {1, 0, 0, 1, 0, 1};
  factor(shape, by, m);
  ball.xx = static_cast<float>(m[0]), ball.xy = static_cast<float>(m[1]);
  ball.xz = static_cast<float>(m[2]), ball.yy = static_cast<float>(m[3]);
  ball.yz = static_cast<float>(m[4]), ball.zz = static_cast<float>(m[5]);
}

/// kGaussian: base = -w log2(e), so that the contribution is 2^-q; it ends where that falls below
/// `log2_floor` = log2(cutoff iso) (Blinn 1982: r = sqrt((w - ln(cutoff iso)) / a); report 3.2.3).
/// kWyvill: q = a r^2, ends at 1. kInverseSquare: q = r^2, never ends.
template <class F>
PM_HD inline typename F::Ball prepare_ball(const Ball& ball, float log2_floor) {
  constexpr double kLog2E = 1.4426950408889634;
  typename F::Ball out;
  out.x = ball.center.x;
  out.y = ball.center.y;
  out.z = ball.center.z;
  out.w = ball.w;
  double by = 1;
  if (F::kKind == FieldKind::kGaussian) {
    by = static_cast<double>(ball.a) * kLog2E;
    out.base = -least(ball.w * static_cast<float>(kLog2E), kLargestExponent);
    out.limit = -log2_floor;
  } else if (F::kKind == FieldKind::kWyvill) {
    by = static_cast<double>(ball.a);
    out.limit = 1;
  } else {
    out.base = kSmallestDistance2;
    out.limit = kInfinity;
  }
  set_matrix(out, ball.shape, by);
  return out;
}

}  // namespace polymorph
