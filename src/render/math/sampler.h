// Sobol sampler with Owen scrambling: the random numbers of a path. A value is a function of (seed,
// frame, pixel, sample, dimension) and of nothing else. Each pair of dimensions is one
// Owen-scrambled, shuffled Sobol (0,2)-sequence over the whole picture (Burley 2020, "Practical
// hash-based Owen scrambling"), which the pixels draw from in Z-order (Ahmed and Wonka 2020,
// "Screen-space blue-noise diffusion of Monte Carlo sampling error via hierarchical ordering of
// pixels"): the samples of a pixel are well distributed, and so are those of blocks of 2 x 2, 4 x
// 4, ... pixels. The remaining noise is therefore fine-grained (blue).
//
// Steady noise: all frames share one sequence. A pixel that shows only static surfaces draws the
// same part of it in every frame. A pixel that shows motion draws the part of another pixel: the
// pixel's Z-order index is combined by XOR with a number that differs between frames. XOR keeps the
// hierarchy of blocks, so the noise stays fine-grained.
#pragma once

#include <cstdint>
#include <type_traits>

#include "base/random.h"
#include "render/math/simd.h"

namespace polymorph {

/// The Owen-scrambling hash on bit-reversed words (Laine and Karras 2011, constants of Vegdahl
/// 2021).
template <class B>
constexpr B owen_hash(B x, std::uint32_t seed) {
  x = x ^ (x * 0x3d20adeau);
  x = x + seed;
  x = x * ((seed >> 16) | 1u);
  x = x ^ (x * 0x05526c56u);
  x = x ^ (x * 0x53a22864u);
  return x;
}

template <class B>
PM_HD constexpr B reverse_bits(B x) {
#if defined(__CUDA_ARCH__)
  if constexpr (std::is_same_v<B, std::uint32_t>) return __brev(x);
#endif
  x = (x >> 16) | (x << 16);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
}

/// Moves the bits of x to the even positions and clears the odd ones.
constexpr std::uint64_t interleave_zeros(std::uint32_t x) {
  std::uint64_t v = x;
  v = (v | (v << 16)) & 0x0000ffff0000ffffull;
  v = (v | (v << 8)) & 0x00ff00ff00ff00ffull;
  v = (v | (v << 4)) & 0x0f0f0f0f0f0f0f0full;
  v = (v | (v << 2)) & 0x3333333333333333ull;
  return (v | (v << 1)) & 0x5555555555555555ull;
}

/// Computes the second dimension of Sobol's sequence, bit-reversed as owen_hash() needs it. (The
/// first dimension, bit-reversed, is the index itself.) The generator matrix is Pascal's triangle
/// mod 2: if the bits of the index are the coefficients of a polynomial p(x) over GF(2), those of
/// the result belong to p(x + 1). Each step replaces x^(2^k) by 1 + x^(2^k).
template <class B>
constexpr B sobol_second(B index) {
  index = index ^ ((index >> 1) & 0x55555555u);
  index = index ^ ((index >> 2) & 0x33333333u);
  index = index ^ ((index >> 4) & 0x0f0f0f0fu);
  index = index ^ ((index >> 8) & 0x00ff00ffu);
  return index ^ (index >> 16);
}

/// Sampler state that is common to all pixels of a frame.
struct FrameSampler {
  std::uint64_t key = 0;  ///< hash of (seed, frame), or of the seed only with steady noise
  int sample_bits = 0;    ///< 2^sample_bits >= samples per pixel
  /// Combined by XOR with the Z-order index of pixels that show motion; 0 without steady noise.
  std::uint64_t motion_xor = 0;
};
FrameSampler make_frame_sampler(std::uint64_t seed, int frame, int samples, bool steady = false);

/// Position of a sample in the frame's sequence.
struct SampleIndex {
  /// Number of the sequence, 0 for the first 2^32 samples of the picture. All 2^8 pixels of a
  /// 16 x 16 tile use the same sequence if a pixel has at most 2^24 samples.
  std::uint32_t sequence = 0;
  std::uint32_t reversed = 0;  ///< bit-reversed index in the sequence
};
/// Finds the position of a pixel's sample. `moving`: the pixel shows motion, or the camera moves.
PM_HD inline SampleIndex sample_index(const FrameSampler& frame, int x, int y, std::uint32_t sample,
                                      bool moving = false) {
  std::uint64_t order = interleave_zeros(static_cast<std::uint32_t>(x)) |
                        (interleave_zeros(static_cast<std::uint32_t>(y)) << 1);
  if (moving) order ^= frame.motion_xor;
  const std::uint64_t index = (order << frame.sample_bits) | sample;
  return {static_cast<std::uint32_t>(index >> 32), reverse_bits(static_cast<std::uint32_t>(index))};
}

/// Two independent pairs of random numbers, (a, b) and (c, d), in [0, 1).
template <class V>
struct Sample4Of {
  V a, b, c, d;
};
using Sample4 = Sample4Of<float>;

/// Random numbers of one sample, or of eight samples that may belong to different pixels.
template <class V>
class PathSamplerOf {
 public:
  /// Multiples of the golden ratio, as a 64-bit fraction, give each sequence a key of its own.
  PM_HD PathSamplerOf(const FrameSampler& frame, std::uint32_t sequence, BitsOf<V> reversed_index)
      : key_(frame.key + sequence * 0x9e3779b97f4a7c15ull), reversed_index_(reversed_index) {}

  /// Returns the numbers of a set, a group of four dimensions. Set 0 is for the pixel filter and
  /// the lens, set 1 + v for path vertex v. camera_rays.h (kTimeSet) and scatter.h (VertexRandomOf)
  /// list the other sets.
  PM_HD_CALL Sample4Of<V> get(std::uint32_t set) const {
    Sample4Of<V> numbers;
    draw_pair(mix64(key_ ^ (2 * set)), numbers.a, numbers.b);
    draw_pair(mix64(key_ ^ (2 * set + 1)), numbers.c, numbers.d);
    return numbers;
  }

 private:
  /// Draws two dimensions: shuffles the index by the upper half of the seed, then scrambles both
  /// Sobol numbers by the lower half, the second one with a seed derived from it.
  PM_HD void draw_pair(std::uint64_t seed, V& a, V& b) const {
    const auto value_seed = static_cast<std::uint32_t>(seed);
    const BitsOf<V> index =
        reverse_bits(owen_hash(reversed_index_, static_cast<std::uint32_t>(seed >> 32)));
    a = to_unit_float(index, value_seed);
    b = to_unit_float(sobol_second(index), value_seed * 0x9e3779b9u + 0x7f4a7c15u);
  }
  /// Scrambles a bit-reversed number, and scales its upper 24 bits to [0, 1).
  PM_HD static V to_unit_float(BitsOf<V> x, std::uint32_t seed) {
    return signed_to_float(reverse_bits(owen_hash(x, seed)) >> 8) * 0x1p-24f;
  }

  std::uint64_t key_ = 0;  ///< hash of the frame and the sequence
  BitsOf<V> reversed_index_;
};

class PathSampler : public PathSamplerOf<float> {
 public:
  PathSampler(const FrameSampler& frame, int x, int y, std::uint32_t sample)
      : PathSampler(frame, sample_index(frame, x, y, sample)) {}
  PathSampler(const FrameSampler& frame, SampleIndex index)
      : PathSamplerOf<float>(frame, index.sequence, index.reversed) {}
};

}  // namespace polymorph
