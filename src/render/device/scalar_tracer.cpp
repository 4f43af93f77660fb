#include <vector>

#include "base/parallel.h"
#include "kernels/floating_point.h"
#include "render/device/device_tracer.h"
#include "render/device/trace_path.h"

namespace polymorph {
namespace {

class ScalarTracer : public DeviceTracer {
 public:
  std::string trace(const FrameJob& job, DeviceFilm& film, RayStats& stats) override {
    DeviceFrame frame;
    std::vector<std::byte> memory(pack_frame(job, nullptr, nullptr, frame));
    const DeviceBuffers buffers = size_buffers(job, frame, memory.size(), max_memory_);
    if (!buffers.error.empty()) return buffers.error;
    pack_frame(job, memory.data(), memory.data(), frame);
    const Bvh bvh = build_bvh(frame.scene);
    frame.scene.nodes = bvh.nodes;
    frame.scene.triangles = bvh.triangles;
    frame.scene.root = bvh.root;
    const auto width = static_cast<std::size_t>(job.image.width),
               height = static_cast<std::size_t>(job.image.height),
               nodes = static_cast<std::size_t>(frame.node_count);
    sums_.assign(width * height * nodes, {});
    centers_.resize(width * height);
    std::vector<char> done(width * height);
    auto* is_done = reinterpret_cast<bool*>(done.data());
    std::vector<RayStats> rows(height);
    for (int first = job.samples.first, end; first < job.samples.end; first = end) {
      end = round_end(frame.noise, first, job.samples.end);
      frame.first_sample = first;
      frame.end_sample = end;
      parallel_for(job.image.height, [&](std::int64_t y) {
        const FlushDenormals flush;
        const auto row = static_cast<std::size_t>(y);
        for (int x = 0; x < job.image.width; ++x) {
          const std::size_t pixel = row * width + static_cast<std::size_t>(x);
          if (!is_done[pixel])
            trace_pixel(frame, x, static_cast<int>(y), &sums_[pixel * nodes], centers_[pixel],
                        rows[row]);
        }
      });
      if (end == job.samples.end) break;
      bool any = false;
      const FlushDenormals flush;
      for (int tile = 0; tile < count_tiles(frame); ++tile)
        any = mark_tile(frame, tile, sums_.data(), is_done) || any;
      if (!any) break;
    }
    for (const RayStats& row : rows) {
      stats.rays += row.rays;
      stats.paths += row.paths;
    }
    film = {list_nodes(job.samples), sums_, centers_};
    return "";
  }

 private:
  static void trace_pixel(const DeviceFrame& frame, int x, int y, PixelSum* sums, MeshHit& center,
                          RayStats& stats) {
    const bool continues = frame.noise > 0 && frame.first_sample > 0;
    if (frame.finds_centers && !continues) center = find_center(frame, x, y, stats);
    std::vector<PathLight> lights;
    for (int s = frame.first_sample; s < frame.end_sample; ++s)
      lights.push_back(trace_sample(frame, x, y, static_cast<std::uint32_t>(s),
                                    shows_motion(frame, center), stats));
    sum_samples(lights.data(), frame.first_sample, frame.end_sample, continues, sums);
  }

  std::vector<PixelSum> sums_;
  std::vector<MeshHit> centers_;
};

}  // namespace

std::unique_ptr<DeviceTracer> make_scalar_tracer() { return std::make_unique<ScalarTracer>(); }

}  // namespace polymorph
