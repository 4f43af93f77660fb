// Arithmetic with the same bits on the CPU and on the GPU: only + - * / sqrt, explicit fma and
// integer operations, each of which IEEE 754 defines exactly. No libm: its exp differs between the
// two sides. Results do not depend on contraction, which is off in both compilers; fma is used
// where it is named.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "host_device.h"

namespace polymorph {

/// a * b + c, rounded once.
PM_HD inline float fused(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
  return __fmaf_rn(a, b, c);
#else
  return std::fma(a, b, c);
#endif
}

PM_HD inline double square_root(double a) {
#if defined(__CUDA_ARCH__)
  return __dsqrt_rn(a);
#else
  return std::sqrt(a);
#endif
}

PM_HD inline float square_root(float a) {
#if defined(__CUDA_ARCH__)
  return __fsqrt_rn(a);
#else
  return std::sqrt(a);
#endif
}

PM_HD inline std::uint32_t float_bits(float a) {
#if defined(__CUDA_ARCH__)
  return __float_as_uint(a);
#else
  std::uint32_t bits;
  std::memcpy(&bits, &a, sizeof bits);
  return bits;
#endif
}

PM_HD inline float float_from_bits(std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(bits);
#else
  float a;
  std::memcpy(&a, &bits, sizeof a);
  return a;
#endif
}

PM_HD inline int count_bits(std::uint32_t a) {
#if defined(__CUDA_ARCH__)
  return __popc(a);
#else
  return __builtin_popcount(a);
#endif
}

/// The range of power_of_two(): sums of 10^8 terms of 2^100 stay finite, and below 2^-125 the
/// result would leave the normal numbers.
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kLargestExponent = 100.0f;
constexpr float kSmallestExponent = -125.0f;

/// 2^e for e in [kSmallestExponent, kLargestExponent], meaningless outside: a clamp here would be a
/// branch in the innermost loop. Exact for whole e, relative error <= 1.5e-7.
PM_HD inline float power_of_two(float e) {
  // Adding 1.5 * 2^23 rounds to the nearest integer and leaves it in the low bits of the sum.
  constexpr float kRound = 12582912.0f;
  const float shifted = e + kRound;
  const float f = e - (shifted - kRound);
  // 2^f on [-1/2, 1/2]: relative error 5e-9 (Chebyshev nodes) with the constant term held at 1.
  float p = 0x1.44138ap-13f;
  p = fused(p, f, 0x1.5f0890p-10f);
  p = fused(p, f, 0x1.3b2a54p-7f);
  p = fused(p, f, 0x1.c6af6cp-5f);
  p = fused(p, f, 0x1.ebfbe0p-3f);
  p = fused(p, f, 0x1.62e43p-1f);
  p = fused(p, f, 1.0f);
  return float_from_bits(float_bits(p) + (float_bits(shifted) << 23));
}

/// `a` where `keep`, else +0, whatever `a` is; without a branch.
PM_HD inline float kept_if(bool keep, float a) {
  return float_from_bits(float_bits(a) & (0u - static_cast<std::uint32_t>(keep)));
}

/// The smaller and the larger of two; without a branch.
PM_HD inline float least(float a, float b) { return kept_if(a < b, a) + kept_if(!(a < b), b); }
PM_HD inline float most(float a, float b) { return kept_if(a > b, a) + kept_if(!(a > b), b); }

/// log2(a) of a normal a > 0; absolute error <= 2e-7 max(1, |log2 a|).
PM_HD inline float log_of_two(float a) {
  // a = 2^k m with m in [sqrt(1/2), sqrt(2)); 0x3f3504f3 are the bits of sqrt(1/2).
  const std::uint32_t bits = float_bits(a);
  const std::uint32_t k = (bits - 0x3f3504f3u) & 0xff800000u;
  const float m = float_from_bits(bits - k);
  const float exponent = static_cast<float>(static_cast<std::int32_t>(k)) * 0x1p-23f;
  // ln m = 2 artanh(s); |s| <= 0.172, so the first term left out is below 5e-8.
  const float s = (m - 1.0f) / (m + 1.0f);
  const float s2 = s * s;
  float p = fused(s2, 2.0f / 7.0f, 2.0f / 5.0f);
  p = fused(p, s2, 2.0f / 3.0f);
  p = fused(p, s2, 2.0f);
  constexpr float kLog2E = 1.44269504f;
  return fused(p * s, kLog2E, exponent);
}

}  // namespace polymorph
