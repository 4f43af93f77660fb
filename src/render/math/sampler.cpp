#include "render/math/sampler.h"

#include <bit>

#include "base/result.h"

namespace polymorph {

FrameSampler make_frame_sampler(std::uint64_t seed, int frame, int samples, bool steady) {
  PM_CHECK(samples >= 1);
  FrameSampler sampler;
  sampler.sample_bits = static_cast<int>(std::bit_width(static_cast<std::uint32_t>(samples) - 1));
  const auto frame_index = static_cast<std::uint32_t>(frame);
  sampler.key = random_u64(seed, steady ? 0 : frame_index, 0);
  // The upper bits are dropped, because XOR with `motion_xor` must not change
  // SampleIndex::sequence.
  if (steady) sampler.motion_xor = random_u64(seed, frame_index, 1) >> (32 + sampler.sample_bits);
  return sampler;
}

}  // namespace polymorph
