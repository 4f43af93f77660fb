// SIMD types of the renderer: code is written once for one float or for eight (Pack, one vector of
// AVX2), as in the kernels. A function for both is a template on the type of its vectors, Vec3 or
// Pack3. Conditions are masks: both branches are computed, and select() chooses one per lane. A
// lane that is not used may hold any value. GPU code has the one-float versions only: PM_PACKS is
// not defined there.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "kernels/simd_math.h"
#include "kernels/types.h"

/// Marks a host and device function that GPU code calls instead of inlining it, because it is large
/// and has many callers.
#if defined(__CUDACC__)
#define PM_HD_CALL __host__ __device__ __noinline__
#else
#define PM_HD_CALL
#endif

namespace polymorph {

/// Types that belong to one float (or Vec3) or to eight (Pack, Pack3): component, mask, and so on.
template <class T>
struct LaneTypes;
template <>
struct LaneTypes<float> {
  using Two = Vec2;
  using Three = Vec3;
  using Mask = bool;
  using Bits = std::uint32_t;
};
template <>
struct LaneTypes<Vec3> : LaneTypes<float> {
  using Component = float;
};
template <class T3>
using ComponentOf = typename LaneTypes<T3>::Component;
template <class T>
using Vec2Of = typename LaneTypes<T>::Two;
template <class T>
using Vec3Of = typename LaneTypes<T>::Three;
template <class T>
using MaskOf = typename LaneTypes<T>::Mask;
template <class T>
using BitsOf = typename LaneTypes<T>::Bits;

template <class T3>
PM_HD inline T3 broadcast3(Vec3 a) {
  return {broadcast<ComponentOf<T3>>(a.x), broadcast<ComponentOf<T3>>(a.y),
          broadcast<ComponentOf<T3>>(a.z)};
}
PM_HD inline Vec3 select(bool first, Vec3 a, Vec3 b) { return first ? a : b; }
PM_HD inline Vec3 zero_unless(bool keep, Vec3 a) { return keep ? a : Vec3{}; }
PM_HD inline bool any(bool mask) { return mask; }
/// A mask of all lanes or of none.
template <class M>
PM_HD inline M broadcast_mask(bool holds);
template <>
PM_HD inline bool broadcast_mask<bool>(bool holds) {
  return holds;
}
/// Counts the lanes in which the mask holds.
template <class V>
PM_HD inline int count_lanes(MaskOf<V> mask) {
  return popcount(Lanes<V>::bits(mask));
}
/// Flips the sign of `a` if `sign_bit` is 2^31; it may also be 0.
PM_HD inline float xor_sign(std::uint32_t sign_bit, float a) {
  return float_from_bits(float_bits(a) ^ sign_bit);
}
PM_HD inline float copysign(float a, float sign) { return std::copysign(a, sign); }
PM_HD inline float abs(float a) { return std::fabs(a); }
/// Rounds |a| < 2^31 towards zero, to index a table.
PM_HD inline std::int32_t truncate(float a) { return static_cast<std::int32_t>(a); }
PM_HD inline float to_float(std::int32_t a) { return static_cast<float>(a); }
PM_HD inline std::int32_t min(std::int32_t a, std::int32_t b) { return a < b ? a : b; }
PM_HD inline std::int32_t zero_unless(bool keep, std::int32_t a) { return keep ? a : 0; }
/// Returns base[index], index >= 0.
PM_HD inline float gather(const float* base, std::int32_t index) { return base[index]; }

#if defined(PM_PACKS)
inline constexpr int kLanes = Lanes<Pack>::kCount;

struct Pack2 {
  Pack x, y;
};
struct Pack3 {
  Pack x, y, z;
};
template <>
struct LaneTypes<Pack> {
  using Two = Pack2;
  using Three = Pack3;
  using Mask = PackMask;
  using Bits = PackBits;
};
template <>
struct LaneTypes<Pack3> : LaneTypes<Pack> {
  using Component = Pack;
};

inline Pack2 operator+(Pack2 a, Pack2 b) { return {a.x + b.x, a.y + b.y}; }
inline Pack2 operator*(Pack2 a, Pack s) { return {a.x * s, a.y * s}; }
inline Pack3 operator+(Pack3 a, Pack3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Pack3 operator-(Pack3 a, Pack3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Pack3 operator*(Pack3 a, Pack3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline Pack3 operator*(Pack3 a, Pack s) { return {a.x * s, a.y * s, a.z * s}; }
inline Pack3 operator/(Pack3 a, Pack s) { return {a.x / s, a.y / s, a.z / s}; }
inline Pack3 operator*(Pack3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline Pack3 operator-(Pack3 a) { return {-a.x, -a.y, -a.z}; }
inline Pack dot(Pack3 a, Pack3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Pack3 cross(Pack3 a, Pack3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Pack min(Pack a, float b) { return min(a, broadcast<Pack>(b)); }
inline Pack max(Pack a, float b) { return max(a, broadcast<Pack>(b)); }
inline Pack lerp(Pack a, Pack b, Pack t) { return a + (b - a) * t; }
inline Pack3 lerp(Pack3 a, Pack3 b, Pack t) { return a + (b - a) * t; }
inline Pack3 min(Pack3 a, Pack3 b) { return {min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)}; }
inline Pack3 max(Pack3 a, Pack3 b) { return {max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)}; }

inline Pack3 select(PackMask first, Pack3 a, Pack3 b) {
  return {select(first, a.x, b.x), select(first, a.y, b.y), select(first, a.z, b.z)};
}
inline Pack3 zero_unless(PackMask keep, Pack3 a) {
  return {zero_unless(keep, a.x), zero_unless(keep, a.y), zero_unless(keep, a.z)};
}

inline Pack length(Pack3 a) { return sqrt(dot(a, a)); }
/// The zero vector stays zero.
inline Pack3 normalized(Pack3 a) {
  const Pack n = length(a);
  return zero_unless(n > 0.0f, a / n);
}

// Operations with one vector for all lanes.
inline Pack3 operator+(Vec3 a, Pack3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Pack3 operator+(Pack3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Pack3 operator-(Vec3 a, Pack3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Pack3 operator-(Pack3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Pack3 operator*(Pack3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline Pack3 operator*(Vec3 a, Pack s) { return {a.x * s, a.y * s, a.z * s}; }
inline Pack dot(Pack3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

inline bool any(PackMask mask) { return Lanes<Pack>::bits(mask) != 0; }
template <>
inline PackMask broadcast_mask<PackMask>(bool holds) {
  return PackMask{} - static_cast<std::int32_t>(holds);  // -1, all bits set, is true
}

/// Mask of the first `count` lanes, or of all lanes if `count` is larger.
inline PackMask first_lanes(int count) { return PackMask{0, 1, 2, 3, 4, 5, 6, 7} < count; }

inline Pack xor_sign(PackBits sign_bit, Pack a) {
  return float_from_bits(float_bits(a) ^ sign_bit);
}
inline Pack copysign(Pack a, Pack sign) {
  return float_from_bits((float_bits(a) & 0x7fffffffu) | (float_bits(sign) & 0x80000000u));
}
inline Pack abs(Pack a) { return float_from_bits(float_bits(a) & 0x7fffffffu); }

// PackMask also serves as a vector of eight 32-bit integers.
inline PackMask truncate(Pack a) { return __builtin_convertvector(a, PackMask); }
inline Pack to_float(PackMask a) { return __builtin_convertvector(a, Pack); }
inline PackMask min(PackMask a, std::int32_t b) {
  const PackMask all = PackMask{} + b;
  return a < all ? a : all;
}

inline PackMask zero_unless(PackMask keep, std::int32_t a) { return keep & a; }

inline Pack gather(const float* base, PackMask index) {
#if defined(__AVX2__)
  return _mm256_i32gather_ps(base, reinterpret_cast<__m256i>(index), 4);
#else
  Pack out;
  for (int l = 0; l < kLanes; ++l) out[l] = base[index[l]];
  return out;
#endif
}

#endif

/// Two vectors of an array.
template <class T3>
struct PairOf {
  T3 first, second;
};
/// Gathers two vectors from an array. Eight pairs of adjacent vectors take less time than others.
PM_HD inline PairOf<Vec3> gather_pair(const Vec3* base, std::int32_t first, std::int32_t second) {
  return {base[first], base[second]};
}

#if defined(PM_PACKS)
inline Vec3 lane(const Pack3& a, int l) { return {a.x[l], a.y[l], a.z[l]}; }
inline void set_lane(Pack3& a, int l, Vec3 value) {
  a.x[l] = value.x;
  a.y[l] = value.y;
  a.z[l] = value.z;
}

/// Transposes eight rows of eight numbers: interleaves numbers of adjacent rows, then pairs of
/// numbers, then halves of rows.
inline void transpose(const Pack (&r)[kLanes], Pack* columns) {
  Pack pairs[kLanes], fours[kLanes];
  for (int i = 0; i < kLanes; i += 2) {
    pairs[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    pairs[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  for (int i = 0; i < kLanes; i += 4)
    for (int k = 0; k < 2; ++k) {
      const Pack a = pairs[i + k], b = pairs[i + k + 2];
      fours[i + 2 * k] = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
      fours[i + 2 * k + 1] = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
    }
  for (int i = 0; i < 4; ++i) {
    columns[i] = __builtin_shufflevector(fours[i], fours[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    columns[i + 4] = __builtin_shufflevector(fours[i], fours[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

/// Four numbers of one lane.
typedef float Quad __attribute__((vector_size(16)));

/// Loads four numbers from a + index and four from b + index, as eight columns, which takes less
/// time than eight calls of gather(). All four must exist.
inline void gather_fours(const float* a, const float* b, PackMask index, Pack (&columns)[kLanes]) {
  Pack rows[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    Quad from_a, from_b;
    std::memcpy(&from_a, a + index[l], sizeof from_a);
    std::memcpy(&from_b, b + index[l], sizeof from_b);
    rows[l] = __builtin_shufflevector(from_a, from_b, 0, 1, 2, 3, 4, 5, 6, 7);
  }
  transpose(rows, columns);
}
/// Gathers vectors from an array.
inline Pack3 gather(const Vec3* base, PackMask index) {
  static_assert(sizeof(Vec3) == 3 * sizeof(float));
  const PackMask offset = index * 3;
  return {gather(&base->x, offset), gather(&base->y, offset), gather(&base->z, offset)};
}
inline PairOf<Pack3> gather_pair(const Vec3* base, PackMask first, PackMask second) {
  if (any(second != first + 1)) return {gather(base, first), gather(base, second)};
  Pack c[kLanes];
  gather_fours(&base->x, &base->z, first * 3, c);
  return {{c[0], c[1], c[2]}, {c[3], c[6], c[7]}};
}

/// Loads eight rows of kWidth numbers (a multiple of 8) as kWidth columns, with row l in lane l.
/// store_rows() is the inverse.
template <int kWidth>
inline void load_rows(const float* const (&rows)[kLanes], Pack* columns) {
  static_assert(kWidth % kLanes == 0);
  for (int block = 0; block < kWidth; block += kLanes) {
    Pack r[kLanes];
    for (int l = 0; l < kLanes; ++l) r[l] = Lanes<Pack>::load(rows[l] + block);
    transpose(r, columns + block);
  }
}
template <int kWidth>
inline void store_rows(const Pack* columns, float* const (&rows)[kLanes]) {
  static_assert(kWidth % kLanes == 0);
  for (int block = 0; block < kWidth; block += kLanes) {
    Pack c[kLanes], r[kLanes];
    for (int l = 0; l < kLanes; ++l) c[l] = columns[block + l];
    transpose(c, r);
    for (int l = 0; l < kLanes; ++l) Lanes<Pack>::store(rows[l] + block, r[l]);
  }
}

#endif

}  // namespace polymorph
