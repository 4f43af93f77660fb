// A sequence of frames to files: order, names, resume, progress, report.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "image/image.h"
#include "kernels/extract_surface.h"
#include "scene/scene.h"
#include "sequence/frames.h"
#include "sequence/geometry.h"

namespace polymorph {

/// "cpu", "cuda", "cuda:1" or "auto" (CUDA where it answers, else the CPU, said once).
/// Errors: kUsage for another word; kResource when a device asked for by name is not there.
/// `max_memory`: bytes for the surface's buffers and mesh; 0 = no limit.
Result<std::unique_ptr<SurfaceExtractor>> make_extractor(const std::string& device,
                                                         std::string& chosen,
                                                         std::size_t max_memory = 0);

enum class Existing { kRefuse, kSkip, kOverwrite };

struct SequenceSettings {
  std::vector<int> frames;  ///< in the order to render
  FramePattern exr;         ///< empty `before`: no EXR
  FramePattern png;         ///< empty `before`: no PNG
  Existing existing = Existing::kRefuse;
  bool strict = false;      ///< warnings about the scene's files are errors
  bool keep_going = false;  ///< a failed frame does not stop the others
  bool dry_run = false;     ///< only say what would be done
  int jobs = 1;  ///< frames traced at once, and as many written; one more has its surface made
  std::string device = "auto";
  std::size_t max_memory = 0;          ///< bytes for the surface's buffers and mesh; 0 = no limit
  std::string isa;                     ///< of Embree; "" = the best
  std::filesystem::path cache_folder;  ///< empty: none
  std::string command;                 ///< for the image headers
  /// Set from outside (a signal handler) to stop after what is in progress.
  const std::atomic<bool>* stop = nullptr;
};

struct FrameRecord {
  enum class State { kDone, kSkipped, kFailed, kPlanned };
  int frame = 0;
  State state = State::kPlanned;
  std::string stage;
  double seconds = 0, surface_seconds = 0, trace_seconds = 0, write_seconds = 0;
  std::size_t balls = 0, vertices = 0, triangles = 0;
  std::string digest;  ///< of the surface mesh; empty when there is none
  std::vector<std::filesystem::path> files;
  std::string error;
};

struct RunReport {
  std::vector<FrameRecord> frames;
  std::string device, isa, scene_hash;
  int threads = 1;
  double prepare_seconds = 0, total_seconds = 0;
  double frames_seconds = 0;      ///< from the first frame's begin to the last one's end
  std::uint64_t peak_memory = 0;  ///< bytes
  bool stopped = false;
  std::size_t count(FrameRecord::State state) const;
};
std::string to_json(const RunReport& report);

/// How many frames of this size should be traced at once, so that all threads have enough tiles.
int jobs_for(int width, int height, std::size_t frames);

/// Called after each frame: how many are finished of how many, and the last one.
using ProgressCallback =
    std::function<void(std::size_t done, std::size_t of, const FrameRecord& last)>;

/// Renders the frames. Frames one after the other that show the same to the bit (image.steady, and
/// nothing moves) are traced once. Errors: the first failing frame's, unless keep_going.
Result<RunReport> render_sequence(const Scene& scene, const SequenceSettings& settings,
                                  const ProgressCallback& progress);

/// One frame in memory: `geometry` as geometry_at() gave it.
Result<Image> render_frame(const PreparedScene& prepared, const FrameGeometry& geometry,
                           Renderer& renderer, const std::string& device,
                           const std::string& command);

}  // namespace polymorph
