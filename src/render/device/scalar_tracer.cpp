#include <array>

#include "base/parallel.h"
#include "kernels/floating_point.h"
#include "render/device/device_tracer.h"
#include "render/device/trace_path.h"

namespace polymorph {
namespace {

/// Sums of one pixel's samples, block after block.
void trace_pixel(const DeviceFrame& frame, int x, int y, PixelSum* sums, RayStats& stats) {
  const bool moving = shows_motion(frame, x, y, stats);
  for (int first = frame.first_sample; first < frame.end_sample; first += kSampleBlock) {
    const int end = std::min(first + kSampleBlock, frame.end_sample);
    std::array<PathLight, kSampleBlock> lights;
    for (int s = first; s < end; ++s)
      lights[static_cast<std::size_t>(s - first)] =
          trace_sample(frame, x, y, static_cast<std::uint32_t>(s), moving, stats);
    *sums++ = sum_block(lights.data(), first, end);
  }
}

class ScalarTracer : public DeviceTracer {
 public:
  std::string trace(const FrameJob& job, const Bvh& bvh, DeviceSums& sums,
                    RayStats& stats) override {
    DeviceFrame frame;
    std::vector<std::byte> memory(pack_frame(job, bvh, nullptr, nullptr, frame));
    const DeviceBuffers buffers = size_buffers(job, memory.size(), max_memory_);
    if (!buffers.error.empty()) return buffers.error;
    pack_frame(job, bvh, memory.data(), memory.data(), frame);
    const auto width = static_cast<std::size_t>(job.image.width),
               blocks = static_cast<std::size_t>(sums.blocks);
    std::vector<RayStats> rows(static_cast<std::size_t>(job.image.height));
    parallel_for(job.image.height, [&](std::int64_t y) {
      const FlushDenormals flush;
      const auto row = static_cast<std::size_t>(y);
      for (int x = 0; x < job.image.width; ++x)
        trace_pixel(frame, x, static_cast<int>(y),
                    &sums.sums[(row * width + static_cast<std::size_t>(x)) * blocks], rows[row]);
    });
    for (const RayStats& row : rows) {
      stats.rays += row.rays;
      stats.paths += row.paths;
    }
    return "";
  }
};

}  // namespace

std::unique_ptr<DeviceTracer> make_scalar_tracer() { return std::make_unique<ScalarTracer>(); }

}  // namespace polymorph
