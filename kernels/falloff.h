// Metaball field functions (Gaussian, Wyvill, inverse square): the contribution of one ball at a
// point, and the ball in the form in which the kernels read it.
//
// A ball maps a point to u = M (point - center), M upper triangular with M^T M its matrix; for a
// round ball M is one number. Its coordinate there is q = base + u.z^2 + u.y^2 + u.x^2, a chain of
// fma's in this order, and what it contributes a function of q that falls with q (rises for w < 0)
// and is exactly 0 where q > limit.
//
// Each step of the chain rounds monotonically in each argument, and so does each u_k in each
// coordinate of the point. Hence the corners of a box bound every q computed for a point of it,
// rounding included: q is monotone after rounding, which makes culling exact (bricks.h).
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

constexpr int kBatch = 4;

/// Bounds of q over a box: no q computed in it is below `near` or above `far`. Where coordinates
/// overflow, `near` is `base` and `far` may be anything.
template <class V>
struct QRange {
  V near, far;
};

/// The absolute value in [low, high] nearest to 0, and the one furthest from it.
template <class V>
PM_HD inline V nearest(V low, V high) {
  return max(max(low, -high), broadcast<V>(0.0f));
}
template <class V>
PM_HD inline V furthest(V low, V high) {
  return max(high, -low);
}

template <class V>
PM_HD inline QRange<V> q_range(V low_x, V high_x, V low_y, V high_y, V low_z, V high_z,
                               float base) {
  const V nx = nearest(low_x, high_x), ny = nearest(low_y, high_y), nz = nearest(low_z, high_z);
  const V fx = furthest(low_x, high_x), fy = furthest(low_y, high_y), fz = furthest(low_z, high_z);
  const V b = broadcast<V>(base);
  return {fma(nx, nx, fma(ny, ny, fma(nz, nz, b))), fma(fx, fx, fma(fy, fy, fma(fz, fz, b)))};
}

/// A round ball with its constants folded; 32 bytes: one aligned load.
struct alignas(32) RoundBall {
  float x = 0, y = 0, z = 0;
  float scale = 1;  ///< u = scale (point - center)
  float base = 0, limit = 0;
  float w = 0;              ///< unused in exponential fields
  float scale_squared = 1;  ///< scale^2

  template <class V>
  PM_HD V q(V px, V py, V pz) const {
    const V ux = scale * (px - x), uy = scale * (py - y), uz = scale * (pz - z);
    return fma(ux, ux, fma(uy, uy, fma(uz, uz, broadcast<V>(base))));
  }
  /// q of N rows of points that share x and z: what a row shares is computed once. Y is float where
  /// a row has one y, V where lanes have their own.
  template <class V, class Y, int N>
  PM_HD void q_rows(V px, const Y (&py)[N], float pz, V (&out)[N]) const {
    const V ux = scale * (px - x);
    const float uz = scale * (pz - z), q0 = fma(uz, uz, base);
    for (int r = 0; r < N; ++r) {
      const Y uy = scale * (py[r] - y);
      out[r] = fma(ux, ux, spread<V>(fma(uy, uy, broadcast<Y>(q0))));
    }
  }
  /// Half the gradient of q.
  template <class V>
  PM_HD void half_gradient_of_q(V px, V py, V pz, V& gx, V& gy, V& gz) const {
    gx = scale_squared * (px - x), gy = scale_squared * (py - y), gz = scale_squared * (pz - z);
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
    return fma(ux, ux, fma(uy, uy, fma(uz, uz, broadcast<V>(base))));
  }
  template <class V, class Y, int N>
  PM_HD void q_rows(V px, const Y (&py)[N], float pz, V (&out)[N]) const {
    const V dx = px - x;
    const float dz = pz - z, uz = zz * dz, q0 = fma(uz, uz, base);
    for (int r = 0; r < N; ++r) {
      const Y dy = py[r] - y, uy = fma(broadcast<Y>(yy), dy, broadcast<Y>(yz * dz));
      const Y ux_of_row = fma(broadcast<Y>(xy), dy, broadcast<Y>(xz * dz));
      const V ux = fma(broadcast<V>(xx), dx, spread<V>(ux_of_row));
      out[r] = fma(ux, ux, spread<V>(fma(uy, uy, broadcast<Y>(q0))));
    }
  }
  template <class V>
  PM_HD void half_gradient_of_q(V px, V py, V pz, V& gx, V& gy, V& gz) const {
    const V dx = px - x, dy = py - y, dz = pz - z;
    const V ux = along_x(dx, dy, dz), uy = along_y(dy, dz), uz = zz * dz;
    gx = xx * ux;
    gy = fma(broadcast<V>(yy), uy, xy * ux);
    gz = fma(broadcast<V>(zz), uz, fma(broadcast<V>(yz), uy, xz * ux));
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
    return fma(broadcast<V>(xx), dx, fma(broadcast<V>(xy), dy, xz * dz));
  }
  template <class V>
  PM_HD V along_y(V dy, V dz) const {
    return fma(broadcast<V>(yy), dy, yz * dz);
  }
};

/// The smallest ratio of a pivot to its diagonal entry at which a shape counts as positive
/// definite: some ten times the rounding of its entries. Axes may differ by a factor of 1000.
constexpr double kMinPivot = 1e-6;

/// M of a symmetric matrix: its Cholesky factor (upper; matrix = M^T M). False where the matrix is
/// not positive definite.
PM_HD inline bool factor(const Sym3& s, double by, double (&m)[6]) {
  const double xx = by * static_cast<double>(s.xx), yy = by * static_cast<double>(s.yy),
               zz = by * static_cast<double>(s.zz);
  if (!(xx > 0 && yy > 0 && zz > 0)) return false;
  m[0] = sqrt(xx);
  m[1] = by * static_cast<double>(s.xy) / m[0];
  m[2] = by * static_cast<double>(s.xz) / m[0];
  const double y2 = yy - m[1] * m[1];
  if (!(y2 > kMinPivot * yy)) return false;
  m[3] = sqrt(y2);
  m[4] = (by * static_cast<double>(s.yz) - m[1] * m[2]) / m[3];
  const double z2 = zz - m[2] * m[2] - m[4] * m[4];
  if (!(z2 > kMinPivot * zz)) return false;
  m[5] = sqrt(z2);
  return true;
}

/// Whether a ball of infinite support is too near a box for a polynomial (far_field.h): near^3 <=
/// reach |w|. So is one clamped to the largest distance, which makes a kink that no polynomial
/// follows.
template <class V>
PM_HD inline auto is_near(V w, QRange<V> q, float reach) {
  return (q.near * (q.near * q.near) <= reach * max(w, -w)) | (q.far >= kMaxDistance2);
}

/// One axis' share of a ball's value where the field splits: u^2 along it, or its sum with base.
/// Within the ball's reach u^2 <= kMaxFactor (prepare_ball); beyond, the share counts nowhere.
template <class V>
PM_HD inline V factor_of(V u2) {
  return exp2(-min(u2, broadcast<V>(kMaxFactor)));
}

/// One field function (field_kinds.h) over balls of one form: what extract() is compiled for.
template <class KindType, class BallType>
struct Field {
  using Ball = BallType;
  using Kind = KindType;
  /// Balls have a limit of their support. Where they have none, distant ones are summed by
  /// far_field.h, and sums take four balls at a time (sum_of_batch).
  static constexpr bool kCompactSupport = Kind::kCompactSupport;
  /// A contribution is a product of three numbers, one per axis: on a grid they are shared.
  static constexpr bool kSeparable = Kind::kExponential && std::is_same<Ball, RoundBall>::value;

  /// Whether a ball belongs in the list of a node over whose box its coordinate has the range q.
  template <class V>
  PM_HD static auto reaches(const Ball& ball, QRange<V> q, float reach) {
    if constexpr (kCompactSupport) {
      return q.near <= ball.limit;
    } else {
      return is_near(broadcast<V>(ball.w), q, reach);
    }
  }

  /// What a ball contributes where its coordinate is q.
  template <class V>
  PM_HD static V value(const Ball& ball, V q) {
    return Kind::value(ball, q);
  }
  /// -d value / dq, up to one positive factor common to all balls.
  template <class V>
  PM_HD static V negated_derivative(const Ball& ball, V q) {
    return Kind::negated_derivative(ball, q);
  }
};

PM_HD inline void set_matrix(RoundBall& ball, const Sym3&, double by) {
  ball.scale = static_cast<float>(sqrt(by));
  ball.scale_squared = static_cast<float>(by);
}
PM_HD inline void set_matrix(EllipsoidBall& ball, const Sym3& shape, double by) {
  double m[6] = {1, 0, 0, 1, 0, 1};
  factor(shape, by, m);
  ball.xx = static_cast<float>(m[0]), ball.xy = static_cast<float>(m[1]);
  ball.xz = static_cast<float>(m[2]), ball.yy = static_cast<float>(m[3]);
  ball.yz = static_cast<float>(m[4]), ball.zz = static_cast<float>(m[5]);
}

/// Four balls of a list from number j on; where it ends before, balls that add nothing.
PM_HD inline void load_batch(const RoundBall* balls, const std::uint32_t* list, std::uint32_t left,
                             RoundBall (&out)[kBatch]) {
  for (std::uint32_t i = 0; i < kBatch; ++i) {
    RoundBall nothing;
    nothing.scale = 0, nothing.base = 1;
    out[i] = i < left ? balls[list[i]] : nothing;
  }
}

/// w0 / q0 + w1 / q1 + w2 / q2 + w3 / q3 with one division.
template <class BallType, class V>
PM_HD inline V sum_of_batch(const BallType (&b)[kBatch], const V (&q)[kBatch]) {
  const V n01 = fma(broadcast<V>(b[0].w), q[1], b[1].w * q[0]), d01 = q[0] * q[1];
  const V n23 = fma(broadcast<V>(b[2].w), q[3], b[3].w * q[2]), d23 = q[2] * q[3];
  return fma(n01, d23, n23 * d01) / (d01 * d23);
}

/// The sum with what a ball of a field that splits adds at a point: the bits of the grid's points.
template <class V>
PM_HD inline V plus_product(V sum, const RoundBall& ball, V x, V y, V z) {
  const V ux = ball.scale * (x - ball.x), uy = ball.scale * (y - ball.y),
          uz = ball.scale * (z - ball.z);
  const V along_x = factor_of(fma(ux, ux, broadcast<V>(ball.base)));
  return fma(zero_unless(ball.q(x, y, z) <= ball.limit, along_x),
             factor_of(uy * uy) * factor_of(uz * uz), sum);
}

/// A ball as the kernels read it.
template <class F>
PM_HD inline typename F::Ball prepare_ball(const Ball& ball, FieldScale scale) {
  typename F::Ball out;
  out.x = ball.center.x;
  out.y = ball.center.y;
  out.z = ball.center.z;
  out.w = ball.w;
  const double by = F::Kind::prepare(ball, scale, out);
  set_matrix(out, ball.shape, by);
  return out;
}

}  // namespace polymorph
