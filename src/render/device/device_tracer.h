// Path tracing on another processor than the CPU's lanes, with the same bits.
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

/// Traces frames on a GPU, whose memory it keeps. An error is a text for the log.
class DeviceTracer {
 public:
  virtual ~DeviceTracer() = default;
  /// Traces all samples of the frame. Returns an empty text, or why it could not. What `film`
  /// borrows is there until the next frame.
  virtual std::string trace(const FrameJob& job, DeviceFilm& film, RayStats& stats) = 0;
  /// Finds what each of the rays hits among the frame's meshes, for benchmarks; `bare`: decided in
  /// floats, as a plain loop would. `seconds` is the time of that alone.
  virtual std::string find_hits(const FrameJob& job, std::span<const Ray> rays, bool bare,
                                std::span<MeshHit> hits, double& seconds) = 0;
  /// Frames that would take more memory of the device are refused. 0: no limit.
  void limit_memory(std::size_t bytes) { max_memory_ = bytes; }

 protected:
  std::size_t max_memory_ = 0;
};

/// Opens a CUDA device. Null: `error` says why.
std::unique_ptr<DeviceTracer> make_cuda_tracer(int index, std::string& error);
/// Makes a tracer that does on the CPU what a GPU does, one path after the other: for tests.
std::unique_ptr<DeviceTracer> make_scalar_tracer();

}  // namespace polymorph
