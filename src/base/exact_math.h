// Elementary functions whose results are equal to the bit on all machines. They use only + - * /
// and sqrt, which IEEE 754 rounds in exactly one way, and integer operations, all in a fixed order.
// (Those of the C library differ between its versions and between processors.) Results have errors
// of a few units in the last place. The functions are for values that are computed once or a few
// thousand times per frame; inner loops use kernels/simd_math.h.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace polymorph::exact {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kLn2 = 0.693147180559945309417;

namespace detail {

inline std::uint64_t to_bits(double a) {
  std::uint64_t bits;
  std::memcpy(&bits, &a, sizeof bits);
  return bits;
}
inline double from_bits(std::uint64_t bits) {
  double a;
  std::memcpy(&a, &bits, sizeof a);
  return a;
}
/// Rounds |a| < 2^51 to the nearest integer: a double has no fraction bits from 2^52 on.
inline double round_to_nearest(double a) { return (a + 0x1.8p52) - 0x1.8p52; }

struct SinCos {
  double sine, cosine;
};
/// Taylor series on [-pi/4, pi/4]; the truncation error is below 1e-17.
inline SinCos sin_cos_taylor(double x) {
  const double q = x * x;
  double s = 0, c = 0;
  for (int k = 8; k >= 1; --k) {
    s = (1 + s) * (-q / (2 * k * (2 * k + 1)));
    c = (1 + c) * (-q / ((2 * k - 1) * (2 * k)));
  }
  return {x * (1 + s), 1 + c};
}
/// Sine and cosine of x radians, |x| < 10^5: those of r = x - n pi/2 in [-pi/4, pi/4], swapped and
/// negated according to n mod 4.
inline SinCos sin_cos(double x) {
  const double n = round_to_nearest(x * (2 / kPi));
  // Cody-Waite reduction: the first two parts of pi/2 have 33 bits, so that n times them is exact.
  const double r = ((x - n * 0x1.921fb544p+0) - n * 0x1.0b4611a6p-34) - n * 0x1.3198a2e037073p-69;
  const SinCos a = sin_cos_taylor(r);
  switch (static_cast<std::int64_t>(n) & 3) {
    case 0:
      return a;
    case 1:
      return {a.cosine, -a.sine};
    case 2:
      return {-a.sine, -a.cosine};
    default:
      return {-a.cosine, a.sine};
  }
}

}  // namespace detail

/// Sine, cosine and tangent of x in radians, |x| < 10^5.
inline double sin(double x) { return detail::sin_cos(x).sine; }
inline double cos(double x) { return detail::sin_cos(x).cosine; }
inline double tan(double x) {
  const detail::SinCos a = detail::sin_cos(x);
  return a.sine / a.cosine;
}

/// The exponential function, as 2^n exp(r) for x = n ln 2 + r; 0 for x <= -700, infinite above 700.
inline double exp(double x) {
  if (!(x > -700)) return x != x ? x : 0;
  if (x > 700) return std::numeric_limits<double>::infinity();
  const double n = detail::round_to_nearest(x / kLn2);
  // Cody-Waite reduction with ln 2 in two parts.
  const double r = (x - n * 0x1.62e42feep-1) - n * 0x1.a39ef35793c76p-33;
  double sum = 0;  // Taylor series of exp(r) - 1
  for (int k = 14; k >= 1; --k) sum = (1 + sum) * (r / k);
  // The double 2^n has the biased exponent n + 1023 above 52 zero bits.
  const auto power_bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(n) + 1023) << 52;
  return (1 + sum) * detail::from_bits(power_bits);
}
/// Computes 2^x.
inline double exp2(double x) {
  const double n = detail::round_to_nearest(x);
  // The bits below are right for a normal 2^n only; exp() handles NaN, underflow and overflow.
  if (!(n > -1000 && n < 1000)) return exp(x * kLn2);
  const auto power_bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(n) + 1023) << 52;
  return exp((x - n) * kLn2) * detail::from_bits(power_bits);
}

/// Natural logarithm of a normal x > 0; -infinity for 0 and below.
inline double log(double x) {
  if (!(x > 0)) return x != x ? x : -std::numeric_limits<double>::infinity();
  if (x > std::numeric_limits<double>::max()) return x;
  // x = 2^n m with m in [sqrt(1/2), sqrt(2)). Subtracting the bits of sqrt(1/2) makes the exponent
  // change there instead of at 1. log(m) = 2 atanh(s) with s = (m - 1) / (m + 1), as a series.
  const std::uint64_t bits = detail::to_bits(x);
  const std::uint64_t sqrt_half_bits = 0x3fe6a09e667f3bcdull;
  const auto n = static_cast<std::int64_t>(bits - sqrt_half_bits) >> 52;
  const double m = detail::from_bits(bits - (static_cast<std::uint64_t>(n) << 52));
  const double s = (m - 1) / (m + 1), q = s * s;
  double sum = 0;
  for (int k = 23; k >= 3; k -= 2) sum = q * (1.0 / k + sum);
  return 2 * s * (1 + sum) + static_cast<double>(n) * kLn2;
}
/// Computes log(1 + x) for x > -1, and exp(x) - 1, without cancellation near 0 (Kahan; Higham 2002,
/// 1.14.1).
inline double log1p(double x) {
  const double u = 1 + x;
  return u == 1 ? x : log(u) * (x / (u - 1));
}
inline double expm1(double x) {
  const double u = exp(x);
  if (u == 1) return x;
  // For |x| > 40, u - 1 has no cancellation, and log(u) could be infinite.
  return x < -40 || x > 40 ? u - 1 : (u - 1) * (x / log(u));
}

/// Computes x^y for x >= 0.
inline double pow(double x, double y) {
  if (y == 0 || x == 1) return 1;
  return x == 0 ? (y > 0 ? 0 : std::numeric_limits<double>::infinity()) : exp(y * log(x));
}

/// Arc tangent in (-pi/2, pi/2).
inline double atan(double x) {
  // For |x| > 1, atan(x) = +-pi/2 - atan(1 / x). Halve the angle twice, by
  // tan(a / 2) = t / (1 + sqrt(1 + t^2)), then sum the Taylor series.
  const bool is_steep = std::fabs(x) > 1;
  double t = is_steep ? 1 / x : x;
  for (int i = 0; i < 2; ++i) t = t / (1 + std::sqrt(1 + t * t));
  const double q = t * t;  // t < 0.199
  double sum = 0;
  for (int k = 25; k >= 3; k -= 2) sum = q * ((k % 4 == 1 ? 1.0 : -1.0) / k + sum);
  const double a = 4 * t * (1 + sum);
  return is_steep ? (x > 0 ? kPi / 2 : -kPi / 2) - a : a;
}
/// Angle of the point (x, y) in [-pi, pi]; 0 at the origin.
inline double atan2(double y, double x) {
  if (x == 0 && y == 0) return 0;
  if (std::fabs(y) > std::fabs(x)) return (y > 0 ? kPi / 2 : -kPi / 2) - atan(x / y);
  return atan(y / x) + (x < 0 ? (y < 0 ? -kPi : kPi) : 0);
}
/// Arc cosine and arc sine of x in [-1, 1]: acos(x) is twice the angle whose tangent is
/// sqrt((1 - x) / (1 + x)).
inline double acos(double x) { return 2 * atan2(std::sqrt(1 - x), std::sqrt(1 + x)); }
inline double asin(double x) { return atan(x / std::sqrt((1 - x) * (1 + x))); }

}  // namespace polymorph::exact
