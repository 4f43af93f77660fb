// Run report of a rendered sequence: what became of each frame, and how long it took.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/json.h"
#include "scene/provenance.h"

namespace polymorph {

struct FrameRecord {
  enum class State { kDone, kSkipped, kFailed, kPlanned };
  int frame = 0;
  State state = State::kPlanned;
  std::string stage;
  double seconds = 0, surface_seconds = 0, trace_seconds = 0, write_seconds = 0;
  std::size_t balls = 0, vertices = 0, triangles = 0;
  std::string digest;  ///< digest of the surface mesh; empty when there is none
  std::vector<std::filesystem::path> files;
  std::string error;
};

/// The predicted cost of a frame, from measured ones (sequence/run/estimate.h).
struct FrameEstimate {
  int measured = 0;      ///< frames that it is made from
  double seconds = 0;    ///< per frame: surface, tracing and encoding, with all threads
  double exr_bytes = 0;  ///< per frame as EXR
  double png_bytes = 0;  ///< per frame as PNG
  /// Objects whose balls are not fitted yet, and about how long that takes, with all threads; the
  /// other figures are then those of unfitted balls.
  std::vector<std::string> unfitted;
  double fit_seconds = 0;
  std::uint64_t memory = 0;  ///< bytes at the worst moment (sequence/prepare/memory_estimate.h)
};

struct RunReport {
  std::vector<FrameRecord> frames;
  std::string device, isa, scene_hash;
  int threads = 1;
  double prepare_seconds = 0, total_seconds = 0;
  double frames_seconds = 0;      ///< time between the first frame's begin and the last one's end
  std::uint64_t peak_memory = 0;  ///< bytes
  bool stopped = false;
  Provenance provenance;  ///< scene, files and program that the frames are made from
  std::optional<FrameEstimate> estimate;  ///< predicted cost of a dry run's frames
  std::size_t count(FrameRecord::State state) const;
};
/// The report as JSON: what `render --json` writes.
JsonValue to_json(const RunReport& report);

}  // namespace polymorph
