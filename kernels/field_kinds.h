// Field functions of metaballs: one struct per FieldKind, with everything that depends on the kind.
//
// A ball's coordinate is q = a d^T S d, d the offset from its centre and S its shape; with infinite
// support it is q = d^2. The kernels use the prepared coordinate (falloff.h): q times a constant,
// plus `base`. A kind has the constants kKind, kName, kEllipsoids, kCompactSupport and
// kExponential, and these functions:
//   for the kernels, with the prepared coordinate (V is float or a pack):
//     prepare(ball, scale, out): sets out's base, limit and w, and returns the constant
//     value(ball, q): the contribution; 0 beyond ball.limit
//     negated_derivative(ball, q): minus the derivative of value(), up to a positive factor common
//       to all balls; 0 beyond ball.limit
//     share(ball, q): the weight of the ball's attributes, max(0, value() without the cutoff)
//   for all other code, with the plain coordinate:
//     coordinate(ball, d), coordinate_gradient(ball, d)
//     log_value(ball, q): the logarithm of the contribution; log_slope(ball, q): its derivative
//     end(ball, level): q beyond which a ball adds less than `level`
//     surface(ball): the largest q at which the value of a single ball is 1; <= 0 if it never is
//     radius(ball): a measure of its size, scene units
//     from_sphere(center, radius, constants): a ball for a sphere
//     rescale(ball, level): moves the surface at `level` to the level 1
//     scale_weight(w, share): the weight at which a ball's values are `share` times as large
// A new kind is a struct here, an enumerator in types.h and its name in visit() and kFieldKinds.
#pragma once

#include <algorithm>
#include <cmath>
#include <string_view>

#include "host_device.h"
#include "simd_math.h"
#include "types.h"

namespace polymorph {

/// Range of squared distances in fields of infinite support, in units of FieldScale::length^2. The
/// minimum is added, so that the field is finite at a ball's centre; larger distances are clamped
/// to the maximum. So the product of four squared distances is a normal float, and four balls share
/// a division.
constexpr float kMinDistance2 = 1e-9f, kMaxDistance2 = 1e9f;
/// Upper bound of one axis' term in the coordinate of a separable field, to which
/// separable_factor() clamps; within a ball's support the term is smaller.
constexpr float kMaxAxisExponent = 125.0f;

/// Scales that all balls of a set share.
struct FieldScale {
  float log2_floor = 0;  ///< exponential fields: log2(cutoff iso)
  float length = 1;      ///< infinite support: a power of two, about the size of the set
};

/// Constants of from_sphere() (scene keys `field` and `report`; docs/method.md, Field).
struct BallConstants {
  float blobbiness = 2, blob_constant = 1, magnitude = 1, threshold = 1;
};

/// The common part of kinds with ellipsoids.
struct EllipsoidCoordinate {
  static constexpr bool kEllipsoids = true, kCompactSupport = true, kExponential = false;
  static float coordinate(const Ball& ball, Vec3 d) { return ball.a * quadratic(ball.shape, d); }
  static Vec3 coordinate_gradient(const Ball& ball, Vec3 d) {
    const Sym3& s = ball.shape;
    return Vec3{s.xx * d.x + s.xy * d.y + s.xz * d.z, s.xy * d.x + s.yy * d.y + s.yz * d.z,
                s.xz * d.x + s.yz * d.y + s.zz * d.z} *
           (2 * ball.a);
  }
  static float radius(const Ball& ball) { return 1 / std::sqrt(ball.a); }
  static void rescale(Ball& ball, float level) { ball.w = ball.w / level; }
  static float scale_weight(float w, float share) { return w * share; }
};

/// exp(w - q) (Blinn 1982; report Eq. 3.1). The kernels' q has the factor log2(e), and base = -w
/// log2(e), so that the contribution is 2^-q. The support ends where the contribution falls below
/// cutoff iso, at r = sqrt((w - ln(cutoff iso)) / a) (Blinn; report 3.2.3).
struct GaussianField : EllipsoidCoordinate {
  static constexpr FieldKind kKind = FieldKind::kGaussian;
  static constexpr std::string_view kName = "gaussian";
  /// The value is a product of one factor per axis, and w is part of the exponent.
  static constexpr bool kExponential = true;

  template <class B>
  PM_HD static double prepare(const Ball& ball, FieldScale scale, B& out) {
    constexpr double kLog2E = 1.4426950408889634;
    // Limits -base so that within the support, each axis' term in the coordinate is at most
    // limit - base <= kMaxAxisExponent - 5 (with a margin of 5), which is in the range of exp2().
    const float max_negated_base = min(kMaxExponent, kMaxAxisExponent - 5 + scale.log2_floor);
    out.base = -min(ball.w * static_cast<float>(kLog2E), max_negated_base);
    out.limit = -scale.log2_floor;
    return static_cast<double>(ball.a) * kLog2E;
  }
  template <class V, class B>
  PM_HD static V value(const B& ball, V q) {
    return zero_unless(q <= ball.limit, exp2(-q));
  }
  template <class V, class B>
  PM_HD static V negated_derivative(const B& ball, V q) {
    return value(ball, q);
  }
  template <class V, class B>
  PM_HD static V share(const B&, V q) {
    return zero_unless(q <= kMaxExponent, exp2(-q));
  }

  static float log_value(const Ball& ball, float q) { return ball.w - q; }
  static float log_slope(const Ball&, float) { return -1; }
  static float end(const Ball& ball, float level) { return ball.w - log(level); }
  static float surface(const Ball& ball) { return ball.w; }
  /// The field over the threshold is exp(B (1 - r^2 / R^2)), with the blobbiness B and the sphere's
  /// radius R.
  static Ball from_sphere(Vec3 center, float radius, const BallConstants& c) {
    return {center, c.blobbiness / (radius * radius), c.blobbiness};
  }
  static void rescale(Ball& ball, float level) { ball.w = ball.w - log(level); }
  static float scale_weight(float w, float share) { return w + log(share); }
};

/// w (1 - 22/9 q + 17/9 q^2 - 4/9 q^3) up to q = 1 (Wyvill, McPheeters and Wyvill 1986).
struct WyvillField : EllipsoidCoordinate {
  static constexpr FieldKind kKind = FieldKind::kWyvill;
  static constexpr std::string_view kName = "wyvill";

  template <class B>
  PM_HD static double prepare(const Ball& ball, FieldScale, B& out) {
    out.limit = 1;
    return static_cast<double>(ball.a);
  }
  template <class V, class B>
  PM_HD static V value(const B& ball, V q) {
    const V p = 1.0f - q;
    return zero_unless(q <= ball.limit,
                       (ball.w * (p * p)) * fma(broadcast<V>(-4.0f / 9.0f), q, broadcast<V>(1.0f)));
  }
  /// Minus the derivative is w (1 - q) (22 - 12 q) / 9; the common factor 2 / 9 is left out.
  template <class V, class B>
  PM_HD static V negated_derivative(const B& ball, V q) {
    return zero_unless(q <= ball.limit,
                       ball.w * ((1.0f - q) * fma(broadcast<V>(-6.0f), q, broadcast<V>(11.0f))));
  }
  template <class V, class B>
  PM_HD static V share(const B& ball, V q) {
    return max(value(ball, q), broadcast<V>(0.0f));
  }

  static float falloff(float q) { return q < 1 ? 1 - q * (22 - q * (17 - q * 4)) / 9 : 0.0f; }
  static float log_value(const Ball& ball, float q) {
    return log(std::max(ball.w * falloff(q), 0.0f));
  }
  static float log_slope(const Ball&, float q) {
    const float slope = q < 1 ? -(22 - q * (34 - q * 12)) / 9 : 0.0f;
    return slope / std::max(falloff(q), 1e-12f);  // the bound keeps the quotient finite
  }
  static float end(const Ball&, float) { return 1; }
  static float surface(const Ball& ball) {
    if (!(ball.w > 1)) return 0;
    // Bisection, because falloff() decreases; 40 steps are more than a float resolves.
    float inside = 0, outside = 1;
    for (int step = 0; step < 40; ++step) {
      const float middle = (inside + outside) / 2;
      (ball.w * falloff(middle) > 1 ? inside : outside) = middle;
    }
    return inside;
  }
  /// A ball of w = 2 has the value 1 at half its support's radius; this is the sphere's radius.
  static Ball from_sphere(Vec3 center, float radius, const BallConstants& c) {
    return {center, 0.25f / (radius * radius), 2 * c.magnitude / c.threshold};
  }
};

/// w / d^2 (report, algorithm 5.1): infinite support, round balls only.
struct InverseSquareField {
  static constexpr FieldKind kKind = FieldKind::kInverseSquare;
  static constexpr std::string_view kName = "inverse_square";
  static constexpr bool kEllipsoids = false, kCompactSupport = false, kExponential = false;

  template <class B>
  PM_HD static double prepare(const Ball& ball, FieldScale scale, B& out) {
    out.base = kMinDistance2;
    out.limit = kInfinity;
    out.w = ball.w / (scale.length * scale.length);
    return 1 / (static_cast<double>(scale.length) * static_cast<double>(scale.length));
  }
  template <class V, class B>
  PM_HD static V value(const B& ball, V q) {
    return ball.w / min(q, broadcast<V>(kMaxDistance2));
  }
  template <class V, class B>
  PM_HD static V negated_derivative(const B& ball, V q) {
    const V clamped = min(q, broadcast<V>(kMaxDistance2));
    return ball.w / (clamped * clamped);
  }
  template <class V, class B>
  PM_HD static V share(const B& ball, V q) {
    return max(value(ball, q), broadcast<V>(0.0f));
  }

  // The lower bounds in these functions keep logarithms and quotients finite.
  static float coordinate(const Ball&, Vec3 d) { return std::max(dot(d, d), 1e-20f); }
  static Vec3 coordinate_gradient(const Ball&, Vec3 d) { return d * 2.0f; }
  static float log_value(const Ball& ball, float q) { return log(std::max(ball.w, 1e-30f) / q); }
  static float log_slope(const Ball&, float q) { return -1 / q; }
  static float end(const Ball&, float) { return kInfinity; }
  static float surface(const Ball& ball) { return ball.w; }
  static float radius(const Ball& ball) { return std::sqrt(std::max(ball.w, 1e-12f)); }
  /// The field over the threshold is blob_constant magnitude R^2 / (d^2 threshold), with the
  /// sphere's radius R.
  static Ball from_sphere(Vec3 center, float radius, const BallConstants& c) {
    return {center, 1, c.blob_constant * c.magnitude * (radius * radius) / c.threshold};
  }
  static void rescale(Ball& ball, float level) { ball.w = ball.w / level; }
  static float scale_weight(float w, float share) { return w * share; }
};

/// Calls f with a value of the kind's struct. The only switch over FieldKind.
template <class Function>
decltype(auto) visit(FieldKind kind, const Function& f) {
  switch (kind) {
    case FieldKind::kGaussian:
      return f(GaussianField{});
    case FieldKind::kInverseSquare:
      return f(InverseSquareField{});
    case FieldKind::kWyvill:
      break;
  }
  return f(WyvillField{});
}

inline constexpr FieldKind kFieldKinds[] = {FieldKind::kGaussian, FieldKind::kWyvill,
                                            FieldKind::kInverseSquare};

inline std::string_view field_name(FieldKind kind) {
  return visit(kind, [](auto field) { return decltype(field)::kName; });
}

}  // namespace polymorph
