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

/// Traces frames on a GPU and keeps its buffers for the next frame. Functions return an empty text,
/// or an error for the log.
class DeviceTracer {
 public:
  virtual ~DeviceTracer() = default;
  /// Traces all samples of the frame. The arrays that `film` borrows are valid until the next
  /// frame.
  virtual std::string trace(const FrameJob& job, DeviceFilm& film, RayStats& stats) = 0;
  /// Finds the nearest hits of rays among the frame's meshes, for benchmarks. `bare`: with a plain
  /// test in floats. `seconds` is the time of the queries alone.
  virtual std::string find_hits(const FrameJob& job, std::span<const Ray> rays, bool bare,
                                std::span<MeshHit> hits, double& seconds) = 0;
  /// Frames that would take more memory of the device are refused. 0: no limit.
  void limit_memory(std::size_t bytes) { max_memory_ = bytes; }

 protected:
  std::size_t max_memory_ = 0;
};

/// Opens a CUDA device. Returns null if it cannot; `error` then says why.
std::unique_ptr<DeviceTracer> make_cuda_tracer(int index, std::string& error);
/// Makes a tracer that runs the GPU's code on the CPU, one path after the other, for tests.
std::unique_ptr<DeviceTracer> make_scalar_tracer();

}  // namespace polymorph
