// Four doubles as one vector (GCC and Clang), for loops that compilers do not vectorize themselves.
// Every lane has the bits of the same operations on single numbers.
#pragma once

#if defined(__AVX__)
#include <immintrin.h>
#endif

#include <cmath>
#include <cstdint>
#include <cstring>

namespace polymorph {

using FourDoubles [[gnu::vector_size(4 * sizeof(double))]] = double;
/// Result of a comparison: -1 where it holds, else 0.
using FourIntegers [[gnu::vector_size(4 * sizeof(double))]] = std::int64_t;

inline FourDoubles load_four(const double* from) {
  FourDoubles a;
  std::memcpy(&a, from, sizeof a);
  return a;
}
/// Loads floats and widens them.
inline FourDoubles load_four(const float* from) {
  using FourFloats [[gnu::vector_size(4 * sizeof(float))]] = float;
  FourFloats a;
  std::memcpy(&a, from, sizeof a);
  return __builtin_convertvector(a, FourDoubles);
}
inline void store_four(double* to, FourDoubles a) { std::memcpy(to, &a, sizeof a); }

/// Makes a mask whose bit k is set if the comparison holds in lane k.
inline unsigned mask_of(FourIntegers lanes) {
#if defined(__AVX__)
  return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(lanes)));
#else
  unsigned mask = 0;
  for (int k = 0; k < 4; ++k) mask |= lanes[k] != 0 ? 1u << k : 0u;
  return mask;
#endif
}

inline FourDoubles square_roots(FourDoubles a) {
#if defined(__AVX__)
  return _mm256_sqrt_pd(a);
#else
  for (int k = 0; k < 4; ++k) a[k] = std::sqrt(a[k]);
  return a;
#endif
}

}  // namespace polymorph
