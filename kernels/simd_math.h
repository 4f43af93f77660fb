// Portable SIMD arithmetic (float, or 8 or 16 lanes of AVX2 or AVX-512) with bit-identical results
// on the CPU and on the GPU: only + - * / sqrt, explicit fma and integer operations, each of which
// IEEE 754 defines exactly. libm is not used, because its exp differs between CPU and GPU.
// Contraction is off in both compilers, so that only fma() rounds a product and a sum once.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#if defined(__AVX2__) && !defined(__CUDACC__)
#include <immintrin.h>
#endif

#include "host_device.h"

namespace polymorph {

/// Returns a * b + c, rounded once.
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
/// Returns the index of the lowest set bit of a != 0.
PM_HD inline int countr_zero(std::uint32_t a) {
#if defined(__CUDA_ARCH__)
  return __ffs(static_cast<int>(a)) - 1;
#else
  return __builtin_ctz(a);
#endif
}
PM_HD inline int countr_zero(std::uint64_t a) {
#if defined(__CUDA_ARCH__)
  return __ffsll(static_cast<long long>(a)) - 1;
#else
  return __builtin_ctzll(a);
#endif
}

/// Returns `a` if `keep`, else +0 (even if `a` is a NaN), without a branch.
PM_HD inline float zero_unless(bool keep, float a) {
  return float_from_bits(float_bits(a) & (0u - static_cast<std::uint32_t>(keep)));
}
/// Returns `a` if `first`, else `b`.
PM_HD inline float select(bool first, float a, float b) { return first ? a : b; }

/// Returns the smaller value, max() the larger one. Both return `b` if either value is a NaN.
PM_HD inline float min(float a, float b) { return a < b ? a : b; }
PM_HD inline float max(float a, float b) { return a > b ? a : b; }

/// The lanes of a V (float, Pack or WidePack): their number, broadcasts, loads and stores.
template <class V>
struct Lanes {
  static constexpr int kCount = 1;
  using Half = V;  ///< eight lanes where V has 16, else V
  PM_HD static V broadcast(float a) { return a; }
  PM_HD static V load(const float* from) { return *from; }
  PM_HD static void store(float* to, V a) { *to = a; }
  PM_HD static std::uint32_t load_bits(const std::uint32_t* from) { return *from; }
  /// Returns a mask whose bit l is set if the comparison holds in lane l.
  PM_HD static std::uint32_t bits(bool holds) { return holds ? 1u : 0u; }
  PM_HD static V iota() { return 0; }  ///< 0, 1, 2, ...
};
template <class V>
PM_HD inline V broadcast(float a) {
  return Lanes<V>::broadcast(a);
}

/// Broadcasts a scalar to all lanes; a V stays as it is.
template <class V, class T>
PM_HD inline V spread(T a) {
  if constexpr (std::is_same_v<T, V>) {
    return a;
  } else {
    return broadcast<V>(a);
  }
}

#if defined(__GNUC__) && !defined(__CUDACC__)
#define PM_PACKS  // Pack exists
/// Eight floats: one vector of AVX2. The operations below are those of float above, lane by lane.
typedef float Pack __attribute__((vector_size(32)));
typedef std::int32_t PackMask __attribute__((vector_size(32)));
typedef std::uint32_t PackBits __attribute__((vector_size(32)));

template <>
struct Lanes<Pack> {
  static constexpr int kCount = 8;
  using Half = Pack;
  static Pack broadcast(float a) { return Pack{a, a, a, a, a, a, a, a}; }
  static Pack load(const float* from) {
    Pack a;
    std::memcpy(&a, from, sizeof a);
    return a;
  }
  static void store(float* to, Pack a) { std::memcpy(to, &a, sizeof a); }
  static PackBits load_bits(const std::uint32_t* from) {
    PackBits a;
    std::memcpy(&a, from, sizeof a);
    return a;
  }
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

#if defined(PM_PACKS) && defined(__AVX512F__) && defined(__AVX512DQ__)
#define PM_WIDE_PACKS  // WidePack exists
/// Sixteen floats: one vector of AVX-512.
typedef float WidePack __attribute__((vector_size(64)));
typedef std::int32_t WidePackMask __attribute__((vector_size(64)));
typedef std::uint32_t WidePackBits __attribute__((vector_size(64)));

template <>
struct Lanes<WidePack> {
  static constexpr int kCount = 16;
  using Half = Pack;
  static WidePack broadcast(float a) { return _mm512_set1_ps(a); }
  static WidePack load(const float* from) { return _mm512_loadu_ps(from); }
  static void store(float* to, WidePack a) { _mm512_storeu_ps(to, a); }
  static WidePackBits load_bits(const std::uint32_t* from) {
    return reinterpret_cast<WidePackBits>(_mm512_loadu_si512(from));
  }
  static std::uint32_t bits(WidePackMask holds) {
    return _mm512_movepi32_mask(reinterpret_cast<__m512i>(holds));
  }
  static WidePack iota() { return WidePack{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}; }
};
inline WidePack fma(WidePack a, WidePack b, WidePack c) { return _mm512_fmadd_ps(a, b, c); }
inline WidePack sqrt(WidePack a) { return _mm512_sqrt_ps(a); }
inline WidePackBits float_bits(WidePack a) { return reinterpret_cast<WidePackBits>(a); }
inline WidePack float_from_bits(WidePackBits a) { return reinterpret_cast<WidePack>(a); }
inline WidePack zero_unless(WidePackMask keep, WidePack a) { return keep ? a : WidePack{}; }
inline WidePack select(WidePackMask first, WidePack a, WidePack b) { return first ? a : b; }
inline WidePack min(WidePack a, WidePack b) { return _mm512_min_ps(a, b); }
inline WidePack max(WidePack a, WidePack b) { return _mm512_max_ps(a, b); }
inline WidePack signed_to_float(WidePackBits a) {
  return _mm512_cvtepi32_ps(reinterpret_cast<__m512i>(a));
}
/// Returns a * b + c in the lanes of `mask`, and c in the others.
inline WidePack fma_where(WidePackMask mask, WidePack a, WidePack b, WidePack c) {
  return _mm512_mask3_fmadd_ps(a, b, c, _mm512_movepi32_mask(reinterpret_cast<__m512i>(mask)));
}
/// Returns the lanes of `low`, followed by those of `high`.
inline WidePack join(Pack low, Pack high) {
  return _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
}
/// Transposes 8 rows of 64 floats, 16 columns at a time.
inline void transpose_columns(const float* from, float* to) {
  for (int i = 0; i < 64; i += 16) {
    // Quarter k of quad[c][q] has column 4 k + c of the rows 4 q to 4 q + 3.
    __m512 row[8], quad[4][2];
    for (int r = 0; r < 8; ++r) row[r] = _mm512_loadu_ps(from + 64 * r + i);
    for (int q = 0; q < 2; ++q) {
      const __m512* r = row + 4 * q;
      const __m512d low[2] = {_mm512_castps_pd(_mm512_unpacklo_ps(r[0], r[1])),
                              _mm512_castps_pd(_mm512_unpacklo_ps(r[2], r[3]))};
      const __m512d high[2] = {_mm512_castps_pd(_mm512_unpackhi_ps(r[0], r[1])),
                               _mm512_castps_pd(_mm512_unpackhi_ps(r[2], r[3]))};
      quad[0][q] = _mm512_castpd_ps(_mm512_unpacklo_pd(low[0], low[1]));
      quad[1][q] = _mm512_castpd_ps(_mm512_unpackhi_pd(low[0], low[1]));
      quad[2][q] = _mm512_castpd_ps(_mm512_unpacklo_pd(high[0], high[1]));
      quad[3][q] = _mm512_castpd_ps(_mm512_unpackhi_pd(high[0], high[1]));
    }
    // Each store writes the eight rows of the columns 4 k + c and 4 k + c + 1.
    for (int c = 0; c < 4; c += 2) {
      const __m512 low_quarters = _mm512_shuffle_f32x4(quad[c][0], quad[c][1], 0x44),
                   next_low_quarters = _mm512_shuffle_f32x4(quad[c + 1][0], quad[c + 1][1], 0x44),
                   high_quarters = _mm512_shuffle_f32x4(quad[c][0], quad[c][1], 0xee),
                   next_high_quarters = _mm512_shuffle_f32x4(quad[c + 1][0], quad[c + 1][1], 0xee);
      float* out = to + 8 * (i + c);
      _mm512_storeu_ps(out, _mm512_shuffle_f32x4(low_quarters, next_low_quarters, 0x88));
      _mm512_storeu_ps(out + 32, _mm512_shuffle_f32x4(low_quarters, next_low_quarters, 0xdd));
      _mm512_storeu_ps(out + 64, _mm512_shuffle_f32x4(high_quarters, next_high_quarters, 0x88));
      _mm512_storeu_ps(out + 96, _mm512_shuffle_f32x4(high_quarters, next_high_quarters, 0xdd));
    }
  }
}
#endif
PM_HD inline float signed_to_float(std::uint32_t a) {
  return static_cast<float>(static_cast<std::int32_t>(a));
}

/// Adding this number rounds a number in (-2^22, 2^22) to an integer, which is then in the low bits
/// of the sum. kRoundToInteger itself has the bits 0x4b400000.
constexpr float kRoundToInteger = 0x1.8p23f;

/// Returns the integer nearest to `a`, which must be in (-2^22, 2^22).
template <class V>
PM_HD inline V round_to_nearest(V a) {
  return (a + kRoundToInteger) - kRoundToInteger;
}
/// Converts an integer in [0, 2^22) to an index.
PM_HD inline std::uint32_t to_index(float a) {
  return float_bits(a + kRoundToInteger) - 0x4b400000u;
}
/// Returns base[index].
PM_HD inline float gather(const float* base, std::uint32_t index) { return base[index]; }
/// Loads kSize consecutive floats for each of kRows offsets: out[r][i] = base[index + offsets[r] +
/// i], where kSize is 2 or 4.
template <int kSize, int kRows>
PM_HD inline void gather_rows(const float* base, std::uint32_t index,
                              const std::int32_t (&offsets)[kRows], float (&out)[kRows][kSize]) {
  for (int r = 0; r < kRows; ++r) {
    for (int i = 0; i < kSize; ++i) out[r][i] = (base + offsets[r])[index + i];
  }
}
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
/// Prefetches the cache line of an address. The empty instruction keeps GCC from removing the
/// calls, because GCC regards a function that only prefetches as one without effects.
inline void prefetch_line(const float* address) {
  __builtin_prefetch(address);
  asm volatile("" : : "r"(address));
}
#if defined(__AVX2__)
/// Loads two floats from each of two addresses.
inline __m128 load_pairs(const float* a, const float* b) {
  return _mm_loadh_pi(_mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(a)),
                      reinterpret_cast<const __m64*>(b));
}
#endif
/// Loads two or four consecutive floats at once per lane and row. Eight loads of two floats take
/// half the time of two gathers.
template <int kSize, int kRows>
inline void gather_rows(const float* base, PackBits index, const std::int32_t (&offsets)[kRows],
                        Pack (&out)[kRows][kSize]) {
  alignas(32) std::uint32_t at[8];
  std::memcpy(at, &index, sizeof at);
  for (int r = 0; r < kRows; ++r) {
    const float* row = base + offsets[r];
#if defined(__AVX2__)
    if constexpr (kSize == 2) {
      const __m256 lanes_0145 = _mm256_set_m128(load_pairs(row + at[4], row + at[5]),
                                                load_pairs(row + at[0], row + at[1])),
                   lanes_2367 = _mm256_set_m128(load_pairs(row + at[6], row + at[7]),
                                                load_pairs(row + at[2], row + at[3]));
      out[r][0] = _mm256_shuffle_ps(lanes_0145, lanes_2367, 0x88);
      out[r][1] = _mm256_shuffle_ps(lanes_0145, lanes_2367, 0xdd);
    } else {
      __m256 lanes[4];  // lanes[l]: lanes l and l + 4
      for (int l = 0; l < 4; ++l) {
        lanes[l] = _mm256_set_m128(_mm_loadu_ps(row + at[l + 4]), _mm_loadu_ps(row + at[l]));
      }
      const __m256 low01 = _mm256_unpacklo_ps(lanes[0], lanes[1]),
                   low23 = _mm256_unpacklo_ps(lanes[2], lanes[3]),
                   high01 = _mm256_unpackhi_ps(lanes[0], lanes[1]),
                   high23 = _mm256_unpackhi_ps(lanes[2], lanes[3]);
      out[r][0] = _mm256_shuffle_ps(low01, low23, 0x44);
      out[r][1] = _mm256_shuffle_ps(low01, low23, 0xee);
      out[r][2] = _mm256_shuffle_ps(high01, high23, 0x44);
      out[r][3] = _mm256_shuffle_ps(high01, high23, 0xee);
    }
#else
    for (int l = 0; l < 8; ++l)
      for (int i = 0; i < kSize; ++i) out[r][i][l] = row[at[l] + i];
#endif
  }
}
/// Returns table[index], for indices below 8.
inline Pack permute(Pack table, PackBits index) {
#if defined(__AVX2__)
  return _mm256_permutevar8x32_ps(table, reinterpret_cast<__m256i>(index));
#else
  Pack out;
  for (int l = 0; l < 8; ++l) out[l] = table[index[l]];
  return out;
#endif
}
/// Transposes eight rows of eight floats.
inline void transpose(Pack (&rows)[8]) {
  Pack pairs[8], quads[8];
  for (int i = 0; i < 8; i += 2) {
    const Pack a = rows[i], b = rows[i + 1];
    pairs[i] = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
    pairs[i + 1] = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
  }
  for (int i = 0; i < 8; i += 4)
    for (int k = 0; k < 2; ++k) {
      const Pack a = pairs[i + k], b = pairs[i + k + 2];
      quads[i + 2 * k] = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
      quads[i + 2 * k + 1] = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
    }
  for (int i = 0; i < 4; ++i) {
    const Pack a = quads[i], b = quads[i + 4];
    rows[i] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11);
    rows[i + 4] = __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
  }
}
#endif
#if defined(PM_WIDE_PACKS)
inline WidePackBits to_index(WidePack a) { return float_bits(a + kRoundToInteger) - 0x4b400000u; }
inline WidePack gather(const float* base, WidePackBits index) {
  return _mm512_i32gather_ps(reinterpret_cast<__m512i>(index), base, 4);
}
/// Loads lane by lane, so that an index is read once for all rows.
template <int kSize, int kRows>
inline void gather_rows(const float* base, WidePackBits index, const std::int32_t (&offsets)[kRows],
                        WidePack (&out)[kRows][kSize]) {
  alignas(64) std::uint32_t at[16];
  _mm512_store_si512(at, reinterpret_cast<__m512i>(index));
  const float* rows[kRows];
  for (int r = 0; r < kRows; ++r) rows[r] = base + offsets[r];
  // Quarter q of lanes[r][i] has row r of lane 4 q + i or, of two floats, lanes 4 q + 2 i and the
  // next one.
  __m512 lanes[kRows][kSize];
  const auto load_quarter = [&](auto quarter) {
    constexpr int kQuarter = decltype(quarter)::value;
    for (int i = 0; i < kSize; ++i) {
      const std::uint32_t* lane = at + 4 * kQuarter + (kSize == 2 ? 2 * i : i);
      const std::uint32_t a = lane[0], b = lane[kSize == 2 ? 1 : 0];
      for (int r = 0; r < kRows; ++r) {
        const __m128 loaded =
            kSize == 2 ? load_pairs(rows[r] + a, rows[r] + b) : _mm_loadu_ps(rows[r] + a);
        if constexpr (kQuarter == 0) {
          lanes[r][i] = _mm512_castps128_ps512(loaded);
        } else {
          lanes[r][i] = _mm512_insertf32x4(lanes[r][i], loaded, kQuarter);
        }
      }
    }
  };
  load_quarter(std::integral_constant<int, 0>());
  load_quarter(std::integral_constant<int, 1>());
  load_quarter(std::integral_constant<int, 2>());
  load_quarter(std::integral_constant<int, 3>());
  for (int r = 0; r < kRows; ++r) {
    if constexpr (kSize == 2) {
      out[r][0] = _mm512_shuffle_ps(lanes[r][0], lanes[r][1], 0x88);
      out[r][1] = _mm512_shuffle_ps(lanes[r][0], lanes[r][1], 0xdd);
    } else {
      const __m512 low01 = _mm512_unpacklo_ps(lanes[r][0], lanes[r][1]),
                   low23 = _mm512_unpacklo_ps(lanes[r][2], lanes[r][3]),
                   high01 = _mm512_unpackhi_ps(lanes[r][0], lanes[r][1]),
                   high23 = _mm512_unpackhi_ps(lanes[r][2], lanes[r][3]);
      out[r][0] = _mm512_shuffle_ps(low01, low23, 0x44);
      out[r][1] = _mm512_shuffle_ps(low01, low23, 0xee);
      out[r][2] = _mm512_shuffle_ps(high01, high23, 0x44);
      out[r][3] = _mm512_shuffle_ps(high01, high23, 0xee);
    }
  }
}
/// Returns table[index], for indices below 8.
inline WidePack permute(Pack table, WidePackBits index) {
  return _mm512_permutexvar_ps(reinterpret_cast<__m512i>(index), _mm512_castps256_ps512(table));
}
inline Pack low_half(WidePack a) { return _mm512_castps512_ps256(a); }
inline Pack high_half(WidePack a) { return _mm512_extractf32x8_ps(a, 1); }
#endif

/// Writes x, y and z of the first `count` lanes, one point after the other.
template <class V>
PM_HD inline void store_points(float* to, V x, V y, V z, int count) {
  constexpr int kCount = Lanes<V>::kCount;
  alignas(64) float p[3][kCount];
  Lanes<V>::store(p[0], x), Lanes<V>::store(p[1], y), Lanes<V>::store(p[2], z);
  for (int l = 0; l < kCount && l < count; ++l) {
    to[3 * l] = p[0][l], to[3 * l + 1] = p[1][l], to[3 * l + 2] = p[2][l];
  }
}
/// Writes `base` plus the index of each set bit, lowest first, and returns the number of set bits.
/// `bits` is below 2^24. All 24 elements from `to` on may be overwritten.
template <class V>
PM_HD inline int write_set_bits(std::uint32_t bits, std::uint32_t base, std::uint32_t* to) {
  int n = 0;
  for (; bits != 0; bits &= bits - 1)
    to[n++] = base + static_cast<std::uint32_t>(countr_zero(bits));
  return n;
}
/// Writes, at the index of each set bit, `base` plus the number of set bits below it. `bits` is
/// below 2^24; the elements at the other bits become undefined.
template <class V>
PM_HD inline void number_set_bits(std::uint32_t bits, std::uint32_t base, std::uint32_t* to) {
  for (; bits != 0; bits &= bits - 1) to[countr_zero(bits)] = base++;
}
#if defined(PM_WIDE_PACKS)
template <>
inline void store_points(float* to, WidePack x, WidePack y, WidePack z, int count) {
  // Lane l of vector k is float 16 k + l: coordinate (16 k + l) % 3 of point (16 k + l) / 3. kXy is
  // its lane in x (0 to 15) or y (16 to 31); kZ is its lane in z, where kIsZ has a bit.
  for (int k = 0; k < 3; ++k) {
    alignas(64) static constexpr std::int32_t kXy[3][16] = {
        {0, 16, 0, 1, 17, 0, 2, 18, 0, 3, 19, 0, 4, 20, 0, 5},
        {21, 0, 6, 22, 0, 7, 23, 0, 8, 24, 0, 9, 25, 0, 10, 26},
        {0, 11, 27, 0, 12, 28, 0, 13, 29, 0, 14, 30, 0, 15, 31, 0}};
    alignas(64) static constexpr std::int32_t kZ[3][16] = {
        {0, 0, 0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0},
        {0, 5, 0, 0, 6, 0, 0, 7, 0, 0, 8, 0, 0, 9, 0, 0},
        {10, 0, 0, 11, 0, 0, 12, 0, 0, 13, 0, 0, 14, 0, 0, 15}};
    constexpr __mmask16 kIsZ[3] = {0x4924, 0x2492, 0x9249};
    const __m512 xy = _mm512_permutex2var_ps(x, _mm512_load_si512(kXy[k]), y);
    const __m512 xyz = _mm512_mask_permutexvar_ps(xy, kIsZ[k], _mm512_load_si512(kZ[k]), z);
    const int remaining = 3 * count - 16 * k;
    if (remaining >= 16) {
      _mm512_storeu_ps(to + 16 * k, xyz);
    } else if (remaining > 0) {
      _mm512_mask_storeu_ps(to + 16 * k, static_cast<__mmask16>((1u << remaining) - 1), xyz);
    }
  }
}
template <>
inline int write_set_bits<WidePack>(std::uint32_t bits, std::uint32_t base, std::uint32_t* to) {
  const __m512i numbers =
      _mm512_add_epi32(_mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15),
                       _mm512_set1_epi32(static_cast<int>(base)));
  const auto low = static_cast<__mmask16>(bits);
  const auto high = static_cast<__mmask8>(bits >> 16);
  const int n = popcount(bits & 0xffffu);
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(low, numbers));
  _mm256_storeu_si256(
      reinterpret_cast<__m256i*>(to + n),
      _mm256_maskz_compress_epi32(
          high, _mm256_add_epi32(_mm512_castsi512_si256(numbers), _mm256_set1_epi32(16))));
  return n + popcount(bits >> 16);
}
template <>
inline void number_set_bits<WidePack>(std::uint32_t bits, std::uint32_t base, std::uint32_t* to) {
  const __m512i numbers =
      _mm512_add_epi32(_mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15),
                       _mm512_set1_epi32(static_cast<int>(base)));
  const __m256i high_numbers = _mm256_add_epi32(_mm512_castsi512_si256(numbers),
                                                _mm256_set1_epi32(popcount(bits & 0xffffu)));
  _mm512_storeu_si512(to, _mm512_maskz_expand_epi32(static_cast<__mmask16>(bits), numbers));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + 16),
                      _mm256_maskz_expand_epi32(static_cast<__mmask8>(bits >> 16), high_numbers));
}
#endif

constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// The range of exp2(): sums of 10^8 terms of 2^100 stay finite, and below 2^-125 the
/// result would leave the normal numbers.
constexpr float kMaxExponent = 100.0f;
constexpr float kMinExponent = -125.0f;

/// Returns 2^e for e in [kMinExponent, kMaxExponent], and an undefined value for other e: a clamp
/// would take time in the innermost loop. Exact for integers, relative error <= 1.5e-7.
template <class V>
PM_HD inline V exp2(V e) {
  // The low bits of `shifted` are the nearest integer, which the last line adds to p's exponent.
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

/// Returns log2(a) of a normal a > 0, with an absolute error <= 2e-7 max(1, |log2 a|).
template <class V>
PM_HD inline V log2(V a) {
  // a = 2^(k / 2^23) m with m in [sqrt(1/2), sqrt(2)); sqrt(1/2) has the bits 0x3f3504f3.
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

/// Returns the natural logarithm of a >= 0, with the errors of log2(); -infinity for 0.
PM_HD inline float log(float a) { return a > 0 ? 0.693147181f * log2(a) : -kInfinity; }

}  // namespace polymorph
