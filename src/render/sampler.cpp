#include "render/sampler.h"

#include <bit>

#include "base/result.h"

namespace polymorph {
namespace {

SobolTable make_table() {
  std::array<SobolPoint, 32> bits;  // of the reversed index: bit 31 is the index's lowest
  // Direction numbers of dimension 2: v_k = v_(k-1) ^ (v_(k-1) >> 1); dimension 1 is the reversed
  // index.
  for (std::uint32_t k = 0, v = 1u << 31; k < 32; ++k, v ^= v >> 1)
    bits[31 - k] = {1u << k, reverse_bits(v)};
  SobolTable table;
  for (std::uint32_t byte = 0; byte < 4; ++byte)
    for (std::uint32_t value = 0; value < 256; ++value) {
      SobolPoint point;
      for (std::uint32_t bit = 0; bit < 8; ++bit)
        if ((value >> bit) & 1) {
          point.x ^= bits[8 * byte + bit].x;
          point.y ^= bits[8 * byte + bit].y;
        }
      table[byte][value] = point;
    }
  return table;
}

}  // namespace

const SobolTable& sobol_table() {
  static const SobolTable kTable = make_table();
  return kTable;
}

FrameSampler make_frame_sampler(std::uint64_t seed, int frame, int samples) {
  PM_CHECK(samples >= 1);
  return {random_u64(seed, static_cast<std::uint32_t>(frame), 0),
          static_cast<int>(std::bit_width(static_cast<std::uint32_t>(samples) - 1)),
          &sobol_table()};
}

}  // namespace polymorph
