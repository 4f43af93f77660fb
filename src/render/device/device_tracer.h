// Interface of path tracers that render frames on a GPU, with the same bits as the CPU.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "render/rays/ray.h"

namespace polymorph {

struct DeviceFilm;
struct FrameJob;
struct RayStats;

/// Traces frames on a GPU and keeps its buffers for the next frame. Functions return an error for
/// the log, or an empty text.
class DeviceTracer {
 public:
  virtual ~DeviceTracer() = default;
  /// Traces all samples of the frame. The arrays that `film` borrows are valid until the next
  /// frame.
  virtual std::string trace(const FrameJob& job, DeviceFilm& film, RayStats& stats) = 0;
  /// Finds the nearest hits of rays among the frame's meshes, for benchmarks. `bare`: use
  /// DeviceScene::closest_in_floats(). `seconds` becomes the time of the queries alone.
  virtual std::string find_hits(const FrameJob& job, std::span<const Ray> rays, bool bare,
                                std::span<MeshHit> hits, double& seconds) = 0;
  /// Limits the device's memory from now on; trace() refuses frames that need more. 0: no limit.
  void limit_memory(std::size_t bytes) { max_memory_ = bytes; }

 protected:
  std::size_t max_memory_ = 0;
};

/// Makes a tracer on a CUDA device. Returns null, with the reason in `error`, if that fails.
std::unique_ptr<DeviceTracer> make_cuda_tracer(int index, std::string& error);
/// Makes a tracer that runs the GPU's code on the CPU, one path after the other, for tests.
std::unique_ptr<DeviceTracer> make_scalar_tracer();

}  // namespace polymorph
