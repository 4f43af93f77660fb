#include "render/sampler.h"

#include <bit>

#include "base/result.h"

namespace polymorph {

FrameSampler make_frame_sampler(std::uint64_t seed, int frame, int samples) {
  PM_CHECK(samples >= 1);
  return {random_u64(seed, static_cast<std::uint32_t>(frame), 0),
          static_cast<int>(std::bit_width(static_cast<std::uint32_t>(samples) - 1))};
}

}  // namespace polymorph
