#include <vector>

#include "base/parallel.h"
#include "base/stopwatch.h"
#include "kernels/floating_point.h"
#include "render/device/device_tracer.h"
#include "render/device/trace_path.h"

namespace polymorph {
namespace {

/// Memory of a packed frame and of its hierarchy, to which `frame` then refers.
struct PackedFrame {
  std::vector<std::byte> memory;
  Bvh bvh;

  // The first call only computes the size. On the CPU the memory that is written is also the memory
  // that the frame refers to.
  PackedFrame(const FrameJob& job, DeviceFrame& frame)
      : memory(pack_frame(job, nullptr, nullptr, frame)) {
    pack_frame(job, memory.data(), memory.data(), frame);
    bvh = build_bvh(frame.scene);
    frame.scene.nodes = bvh.nodes;
    frame.scene.triangles = bvh.triangles;
    frame.scene.root = bvh.root;
  }
};

/// Runs the GPU's code on the CPU; rows of the picture run in parallel.
class ScalarTracer : public DeviceTracer {
 public:
  std::string find_hits(const FrameJob& job, std::span<const Ray> rays, bool bare,
                        std::span<MeshHit> hits, double& seconds) override {
    DeviceFrame frame;
    const PackedFrame memory(job, frame);
    const Stopwatch stopwatch;
    parallel_for(static_cast<std::int64_t>(rays.size()), [&](std::int64_t i) {
      const FlushDenormals flush;
      hits[i] = bare ? frame.scene.closest_in_floats(rays[i]) : frame.scene.closest(rays[i]);
    });
    seconds = stopwatch.seconds();
    return "";
  }
  std::string trace(const FrameJob& job, DeviceFilm& film, RayStats& stats) override {
    DeviceFrame frame;
    const DeviceBuffers buffers =
        size_buffers(job, frame, pack_frame(job, nullptr, nullptr, frame), max_memory_);
    if (!buffers.error.empty()) return buffers.error;
    const PackedFrame memory(job, frame);
    const auto width = static_cast<std::size_t>(job.image.width),
               height = static_cast<std::size_t>(job.image.height),
               sums_per_pixel = static_cast<std::size_t>(frame.node_count);  // one per list_nodes()
    sums_.assign(width * height * sums_per_pixel, {});
    centers_.resize(width * height);
    std::vector<char> done(width * height);  // vector<bool> has no array of bool
    auto* is_done = reinterpret_cast<bool*>(done.data());
    std::vector<RayStats> row_stats(height);
    for (int first = job.samples.first, end; first < job.samples.end; first = end) {
      end = round_end(frame.noise, first, job.samples.end);
      frame.first_sample = first;
      frame.end_sample = end;
      parallel_for(job.image.height, [&](std::int64_t y) {
        const FlushDenormals flush;
        const auto row = static_cast<std::size_t>(y);
        for (int x = 0; x < job.image.width; ++x) {
          const std::size_t pixel = row * width + static_cast<std::size_t>(x);
          if (!is_done[pixel]) trace_pixel(frame, x, static_cast<int>(y), row_stats[row]);
        }
      });
      if (end == job.samples.end) break;
      bool any_left = false;
      const FlushDenormals flush;
      for (int tile = 0; tile < count_tiles(frame); ++tile)
        any_left = mark_tile(frame, tile, sums_.data(), is_done) || any_left;
      if (!any_left) break;
    }
    for (const RayStats& row : row_stats) {
      stats.rays += row.rays;
      stats.paths += row.paths;
    }
    film = {list_nodes(job.samples), sums_, centers_};
    return "";
  }

 private:
  void trace_pixel(const DeviceFrame& frame, int x, int y, RayStats& stats) {
    const auto pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.camera.size.width) +
        static_cast<std::size_t>(x);
    MeshHit& center = centers_[pixel];
    const bool continues = frame.noise > 0 && frame.first_sample > 0;
    if (frame.finds_centers && !continues) center = find_center(frame, x, y, stats);
    std::vector<PathLight> path_lights;
    for (int s = frame.first_sample; s < frame.end_sample; ++s)
      path_lights.push_back(trace_sample(frame, x, y, static_cast<std::uint32_t>(s),
                                         shows_motion(frame, center), stats));
    sum_samples(path_lights.data(), frame.first_sample, frame.end_sample, continues,
                &sums_[pixel * static_cast<std::size_t>(frame.node_count)]);
  }

  std::vector<PixelSum> sums_;
  std::vector<MeshHit> centers_;
};

}  // namespace

std::unique_ptr<DeviceTracer> make_scalar_tracer() { return std::make_unique<ScalarTracer>(); }

}  // namespace polymorph
