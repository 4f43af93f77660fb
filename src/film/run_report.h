// Report of a rendered sequence: the state of each frame, and the time that it took.
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

/// State and measures of one frame.
struct FrameRecord {
  /// kSkipped: the files are current (Existing::kSkip). kPlanned: not rendered yet, or a dry run.
  enum class State { kDone, kSkipped, kFailed, kPlanned };
  int frame = 0;
  State state = State::kPlanned;
  std::string stage;   ///< distinct names of the actors' stages (stage_names())
  double seconds = 0;  ///< surface_seconds + trace_seconds
  /// Times of making the surfaces, tracing and writing. The first two are 0 for a frame that was
  /// not traced because its pixels are those of the frame before.
  double surface_seconds = 0, trace_seconds = 0, write_seconds = 0;
  std::size_t balls = 0, vertices = 0, triangles = 0;  ///< counts of all surfaces together
  std::string digest;  ///< mesh_digest() of the surfaces; empty if they have no triangles
  std::vector<std::filesystem::path> files;
  std::string error;  ///< message if the frame failed; else empty
};

/// The predicted cost of a frame, from measured frames (film/estimate.h).
struct FrameEstimate {
  int measured = 0;      ///< number of measured frames; 0: no frame had to be rendered
  double seconds = 0;    ///< surface, tracing and encoding per frame, with all threads
  double exr_bytes = 0;  ///< size of an EXR file
  double png_bytes = 0;  ///< size of a PNG file; 0 for parts, which are never PNGs
  /// Objects whose balls are not fitted yet. If there are any, the other figures are measured with
  /// unfitted balls.
  std::vector<std::string> unfitted;
  double fit_seconds = 0;    ///< estimated time of these fits, with all threads
  std::uint64_t memory = 0;  ///< estimated peak bytes (assets/memory_estimate.h)
};

/// Report of a run of render_sequence().
struct RunReport {
  std::vector<FrameRecord> frames;
  /// Devices that rendered ("cpu" or "cuda:0,cuda:1"); instruction set of the tracer
  /// (Renderer::isa()); SequenceHashes::scene.
  std::string device, isa, scene_hash;
  int threads = 1;  ///< number of CPU threads
  double prepare_seconds = 0, total_seconds = 0;
  double frames_seconds = 0;      ///< time from the start of the first frame to the end of the last
  std::uint64_t peak_memory = 0;  ///< bytes
  bool stopped = false;           ///< the caller stopped the run (SequenceSettings::stop)
  Provenance provenance;          ///< scene, files and program that made the frames
  std::optional<FrameEstimate> estimate;              ///< cost of the frames; only after a dry run
  std::size_t count(FrameRecord::State state) const;  ///< number of frames in this state
};
/// Converts the report to the JSON that `render --json` writes.
JsonValue to_json(const RunReport& report);

}  // namespace polymorph
