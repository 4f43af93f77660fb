// Portable SIMD arithmetic (float or 8 lanes of AVX2) with bit-identical results on the CPU and on
// the GPU: only + - * / sqrt, explicit fma and integer operations, each of which IEEE 754 defines
// exactly. No libm: its exp differs between the two sides. Results do not depend on contraction,
// which is off in both compilers; fma is used where it is named.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#if defined(__AVX2__) && !defined(__CUDACC__)
#include <immintrin.h>
#endif

#include "host_device.h"

namespace polymorph {

/// a * b + c, rounded once.
PM_HD inline float fma(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
  return __fmaf_rn(a, b, c);
#else
  return std::fma(a, b, c);
#endif
}

PM_HD inline double sqrt(double a) {
#if defined(__CUDA_ARCH__)
  return __dsqrt_rn(a);
#else
  return std::sqrt(a);
#endif
}

PM_HD inline float sqrt(float a) {
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

PM_HD inline int popcount(std::uint32_t a) {
#if defined(__CUDA_ARCH__)
  return __popc(a);
#else
  return __builtin_popcount(a);
#endif
}
PM_HD inline int popcount(std::uint64_t a) {
#if defined(__CUDA_ARCH__)
  return __popcll(a);
#else
  return __builtin_popcountll(a);
#endif
}
/// The lowest set bit of a != 0.
PM_HD inline int countr_zero(std::uint32_t a) {
#if defined(__CUDA_ARCH__)
  return __ffs(static_cast<int>(a)) - 1;
#else
  return __builtin_ctz(a);
#endif
}

/// `a` where `keep`, else +0, whatever `a` is; without a branch.
PM_HD inline float zero_unless(bool keep, float a) {
  return float_from_bits(float_bits(a) & (0u - static_cast<std::uint32_t>(keep)));
}
/// `a` where `first`, else `b`.
PM_HD inline float select(bool first, float a, float b) { return first ? a : b; }

/// The smaller and the larger of two; `b` where one is not a number.
PM_HD inline float min(float a, float b) { return a < b ? a : b; }
PM_HD inline float max(float a, float b) { return a > b ? a : b; }

/// How many values a V holds, and V's that hold one value everywhere, or values from memory.
template <class V>
struct Lanes {
  static constexpr int kCount = 1;
  PM_HD static V broadcast(float a) { return a; }
  PM_HD static V load(const float* from) { return *from; }
  PM_HD static void store(float* to, V a) { *to = a; }
  /// bit l: whether the comparison holds in lane l
  PM_HD static std::uint32_t bits(bool holds) { return holds ? 1u : 0u; }
  PM_HD static V iota() { return 0; }  ///< 0, 1, 2, ...
};
template <class V>
PM_HD inline V broadcast(float a) {
  return Lanes<V>::broadcast(a);
}

#if defined(__GNUC__) && !defined(__CUDACC__)
#define PM_PACKS
/// Eight floats: one vector of AVX2. Each operation below is that of eight floats.
typedef float Pack __attribute__((vector_size(32)));
typedef std::int32_t PackMask __attribute__((vector_size(32)));
typedef std::uint32_t PackBits __attribute__((vector_size(32)));

template <>
struct Lanes<Pack> {
  static constexpr int kCount = 8;
  static Pack broadcast(float a) { return Pack{a, a, a, a, a, a, a, a}; }
  static Pack load(const float* from) {
    Pack a;
    std::memcpy(&a, from, sizeof a);
    return a;
  }
  static void store(float* to, Pack a) { std::memcpy(to, &a, sizeof a); }
  static std::uint32_t bits(PackMask holds) {
#if defined(__AVX2__)
    return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(holds)));
#else
    std::uint32_t out = 0;
    for (int l = 0; l < 8; ++l) out |= (holds[l] != 0 ? 1u : 0u) << l;
    return out;
#endif
  }
  static Pack iota() { return Pack{0, 1, 2, 3, 4, 5, 6, 7}; }
};
inline Pack fma(Pack a, Pack b, Pack c) {
#if defined(__AVX2__) && defined(__FMA__)
  return _mm256_fmadd_ps(a, b, c);
#else
  for (int l = 0; l < 8; ++l) c[l] = std::fma(a[l], b[l], c[l]);
  return c;
#endif
}
inline Pack sqrt(Pack a) {
#if defined(__AVX2__)
  return _mm256_sqrt_ps(a);
#else
  for (int l = 0; l < 8; ++l) a[l] = std::sqrt(a[l]);
  return a;
#endif
}
inline PackBits float_bits(Pack a) { return reinterpret_cast<PackBits>(a); }
inline Pack float_from_bits(PackBits a) { return reinterpret_cast<Pack>(a); }
inline Pack zero_unless(PackMask keep, Pack a) {
  return reinterpret_cast<Pack>(reinterpret_cast<PackMask>(a) & keep);
}
inline Pack select(PackMask first, Pack a, Pack b) { return first ? a : b; }
inline Pack min(Pack a, Pack b) { return a < b ? a : b; }
inline Pack max(Pack a, Pack b) { return a > b ? a : b; }
inline Pack signed_to_float(PackBits a) {
  return __builtin_convertvector(reinterpret_cast<PackMask>(a), Pack);
}
#endif
PM_HD inline float signed_to_float(std::uint32_t a) {
  return static_cast<float>(static_cast<std::int32_t>(a));
}

/// Adding this rounds a number in (-2^22, 2^22) to a whole one, which stands in the low bits of the
/// sum.
constexpr float kRoundToInteger = 0x1.8p23f;

/// The whole number nearest to `a` in (-2^22, 2^22).
template <class V>
PM_HD inline V round_to_nearest(V a) {
  return (a + kRoundToInteger) - kRoundToInteger;
}
/// A whole number in [0, 2^22) as an index.
PM_HD inline std::uint32_t to_index(float a) {
  return float_bits(a + kRoundToInteger) - 0x4b400000u;
}
/// base[index].
PM_HD inline float gather(const float* base, std::uint32_t index) { return base[index]; }
#if defined(PM_PACKS)
inline PackBits to_index(Pack a) { return float_bits(a + kRoundToInteger) - 0x4b400000u; }
inline Pack gather(const float* base, PackBits index) {
#if defined(__AVX2__)
  return _mm256_i32gather_ps(base, reinterpret_cast<__m256i>(index), 4);
#else
  Pack out;
  for (int l = 0; l < 8; ++l) out[l] = base[index[l]];
  return out;
#endif
}
#endif

/// The range of exp2(): sums of 10^8 terms of 2^100 stay finite, and below 2^-125 the
/// result would leave the normal numbers.
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kMaxExponent = 100.0f;
constexpr float kMinExponent = -125.0f;

/// 2^e for e in [kMinExponent, kMaxExponent], meaningless outside: a clamp here would cost
/// in the innermost loop. Exact for whole e, relative error <= 1.5e-7.
template <class V>
PM_HD inline V exp2(V e) {
  const V shifted = e + kRoundToInteger;
  const V f = e - (shifted - kRoundToInteger);
  // 2^f on [-1/2, 1/2]: relative error 5e-9 (Chebyshev nodes) with the constant term fixed at 1.
  V p = broadcast<V>(0x1.44138ap-13f);
  p = fma(p, f, broadcast<V>(0x1.5f0890p-10f));
  p = fma(p, f, broadcast<V>(0x1.3b2a54p-7f));
  p = fma(p, f, broadcast<V>(0x1.c6af6cp-5f));
  p = fma(p, f, broadcast<V>(0x1.ebfbe0p-3f));
  p = fma(p, f, broadcast<V>(0x1.62e43p-1f));
  p = fma(p, f, broadcast<V>(1.0f));
  return float_from_bits(float_bits(p) + (float_bits(shifted) << 23));
}

/// log2(a) of a normal a > 0; absolute error <= 2e-7 max(1, |log2 a|).
template <class V>
PM_HD inline V log2(V a) {
  // a = 2^k m with m in [sqrt(1/2), sqrt(2)); 0x3f3504f3 are the bits of sqrt(1/2).
  const auto bits = float_bits(a);
  const auto k = (bits - 0x3f3504f3u) & 0xff800000u;
  const V m = float_from_bits(bits - k);
  const V exponent = signed_to_float(k) * 0x1p-23f;
  // ln m = 2 artanh(s); |s| <= 0.172, so the first term left out is below 5e-8.
  const V s = (m - 1.0f) / (m + 1.0f);
  const V s2 = s * s;
  V p = fma(s2, broadcast<V>(2.0f / 7.0f), broadcast<V>(2.0f / 5.0f));
  p = fma(p, s2, broadcast<V>(2.0f / 3.0f));
  p = fma(p, s2, broadcast<V>(2.0f));
  constexpr float kLog2E = 1.44269504f;
  return fma(p * s, broadcast<V>(kLog2E), exponent);
}

/// The natural logarithm of a >= 0, with the errors of log2(); -infinity for 0.
PM_HD inline float log(float a) { return a > 0 ? 0.693147181f * log2(a) : -kInfinity; }

}  // namespace polymorph
