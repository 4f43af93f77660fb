// Counter-based random number generator. A random number depends only on its keys (seed, stream and
// counter), not on the numbers drawn before it. So results do not depend on threads, order or frame
// range.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace polymorph {

/// A well-mixed 64-bit hash of one word (splitmix64's finalizer; Steele et al. 2014).
constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// The random word at (seed, stream, counter); each use of random numbers has a stream of its own.
constexpr std::uint64_t random_u64(std::uint64_t seed, std::uint64_t stream,
                                   std::uint64_t counter) {
  return mix64(counter ^ mix64(stream ^ mix64(seed)));
}

/// Uniform integer in [0, n), n >= 1 (multiply-shift; bias below 2^-32 for n < 2^32).
constexpr std::uint32_t random_below(std::uint32_t n, std::uint64_t seed, std::uint64_t stream,
                                     std::uint64_t counter) {
  return static_cast<std::uint32_t>(
      ((random_u64(seed, stream, counter) >> 32) * static_cast<std::uint64_t>(n)) >> 32);
}

/// Uniform random number in [0, 1).
constexpr float random_float(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
  return static_cast<float>(random_u64(seed, stream, counter) >> 40) * 0x1p-24f;
}

/// Point i of the R3 sequence (Roberts 2018, "The unreasonable effectiveness of quasirandom
/// sequences"), an evenly spread low-discrepancy sequence in [0, 1)^3.
inline std::array<double, 3> r3_point(std::size_t i) {
  // 1 / g, 1 / g^2 and 1 / g^3, where g^4 = g + 1.
  constexpr std::array<double, 3> kStep = {0.8191725133961645, 0.6710436067037893,
                                           0.5497004779019703};
  std::array<double, 3> point;
  for (std::size_t k = 0; k < 3; ++k)
    point[k] = std::fmod(0.5 + kStep[k] * static_cast<double>(i + 1), 1.0);
  return point;
}

}  // namespace polymorph
