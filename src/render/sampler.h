// Random numbers of a path: a value is a function of (seed, frame, pixel, sample, dimension) and of
// nothing else. Each pair of dimensions is one Owen-scrambled, shuffled Sobol (0,2)-sequence over
// the whole picture (Burley 2020, "Practical hash-based Owen scrambling"), which the pixels draw
// from in Z-order (Ahmed and Wonka 2020, "Screen-space blue-noise diffusion of Monte Carlo sampling
// error via hierarchical ordering of pixels"): a pixel's samples fill their square evenly, and so
// do those of 2 x 2, 4 x 4, ... pixels, which turns the noise that is left into a fine grain.
#pragma once

#include <array>
#include <cstdint>

#include "base/random.h"

namespace polymorph {

/// The Owen-scrambling hash on bit-reversed words (Laine and Karras 2011, constants of Vegdahl
/// 2021).
constexpr std::uint32_t owen_hash(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
}

/// The bits of x spread to the even places.
constexpr std::uint64_t spread_bits(std::uint32_t x) {
  std::uint64_t v = x;
  v = (v | (v << 16)) & 0x0000ffff0000ffffull;
  v = (v | (v << 8)) & 0x00ff00ff00ff00ffull;
  v = (v | (v << 4)) & 0x0f0f0f0f0f0f0f0full;
  v = (v | (v << 2)) & 0x3333333333333333ull;
  return (v | (v << 1)) & 0x5555555555555555ull;
}

/// A Sobol point, each coordinate bit-reversed (ready for owen_hash).
struct SobolPoint {
  std::uint32_t x = 0, y = 0;
};

/// The first two dimensions of Sobol's sequence by bytes of the bit-reversed index: the point of an
/// index is the exclusive or of its four bytes' entries.
using SobolTable = std::array<std::array<SobolPoint, 256>, 4>;
const SobolTable& sobol_table();

/// What all pixels of a frame share.
struct FrameSampler {
  std::uint64_t key = 0;  ///< of (seed, frame)
  int sample_bits = 0;    ///< 2^sample_bits >= samples a pixel
  const SobolTable* table = nullptr;
};
FrameSampler make_frame_sampler(std::uint64_t seed, int frame, int samples);

/// Two independent pairs, each in [0, 1).
struct Sample4 {
  float a, b, c, d;
};

/// The numbers of one sample of one pixel.
class PathSampler {
 public:
  PathSampler(const FrameSampler& frame, int x, int y, std::uint32_t sample) : table_(frame.table) {
    const std::uint64_t order = spread_bits(static_cast<std::uint32_t>(x)) |
                                (spread_bits(static_cast<std::uint32_t>(y)) << 1);
    const std::uint64_t index = (order << frame.sample_bits) | sample;
    // Pictures and sample counts beyond 2^32 samples go on in a sequence of their own.
    key_ = frame.key + (index >> 32) * 0x9e3779b97f4a7c15ull;
    reversed_index_ = reverse_bits(static_cast<std::uint32_t>(index));
  }

  /// The numbers of `set`: 0 for the camera, 1 + v for vertex v of the path.
  Sample4 get(std::uint32_t set) const {
    const std::uint64_t first = mix64(key_ ^ (2 * set)), second = mix64(key_ ^ (2 * set + 1));
    const SobolPoint p = point(static_cast<std::uint32_t>(first >> 32));
    const SobolPoint q = point(static_cast<std::uint32_t>(second >> 32));
    const auto s = static_cast<std::uint32_t>(first), t = static_cast<std::uint32_t>(second);
    return {unit(p.x, s), unit(p.y, s * 0x9e3779b9u + 0x7f4a7c15u), unit(q.x, t),
            unit(q.y, t * 0x9e3779b9u + 0x7f4a7c15u)};
  }

 private:
  SobolPoint point(std::uint32_t seed) const {
    const std::uint32_t shuffled = owen_hash(reversed_index_, seed);
    const SobolTable& t = *table_;
    const SobolPoint a = t[0][shuffled & 255], b = t[1][(shuffled >> 8) & 255],
                     c = t[2][(shuffled >> 16) & 255], d = t[3][shuffled >> 24];
    return {a.x ^ b.x ^ c.x ^ d.x, a.y ^ b.y ^ c.y ^ d.y};
  }
  static float unit(std::uint32_t x, std::uint32_t seed) {
    return static_cast<float>(reverse_bits(owen_hash(x, seed)) >> 8) * 0x1p-24f;
  }

  const SobolTable* table_;
  std::uint64_t key_ = 0;
  std::uint32_t reversed_index_ = 0;
};

}  // namespace polymorph
