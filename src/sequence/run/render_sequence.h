// Rendering of a frame sequence to files: order, names, resume, progress, report.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "image/display_view.h"
#include "image/image.h"
#include "kernels/engine.h"
#include "render/sample_range.h"
#include "scene/scene.h"
#include "sequence/run/frames.h"
#include "sequence/run/run_report.h"

namespace polymorph {

enum class Existing { kRefuse, kSkip, kOverwrite };

struct SequenceSettings {
  std::vector<int> frames;          ///< frame numbers, in the order to render
  FramePattern exr;                 ///< empty `before`: no EXR
  FramePattern png;                 ///< empty `before`: no PNG
  DisplayView view;                 ///< view by which PNGs are made
  std::optional<SampleRange> part;  ///< these samples alone, of as many as the scene has
  Existing existing = Existing::kRefuse;
  bool strict = false;      ///< warnings about the scene's files are errors
  bool keep_going = false;  ///< a failed frame does not stop the others
  bool dry_run = false;     ///< only say what would be done
  /// Frames traced at once, and as many written; one more has its surface made, or each of them
  /// where several devices share the film. 0: by their size, and two on each GPU, so that the
  /// host's work on one frame is done while another is traced.
  int jobs = 1;
  std::string device = "auto";         ///< a device, or those that share the film (list_devices())
  std::size_t max_memory = 0;          ///< bytes that the whole run may take; 0 = no limit
  std::filesystem::path cache_folder;  ///< empty: none
  std::string command;                 ///< command line that the image headers state
  /// Set from outside (a signal handler) to stop after what is in progress.
  const std::atomic<bool>* stop = nullptr;
};

/// The number of frames to make at once on so many GPUs: two to four each, by the threads beside
/// them.
int jobs_for_devices(int devices);

/// The number of frames of this size to trace at once, so that all threads have enough tiles.
int jobs_for(int width, int height, std::size_t frames);

/// Called after each frame: how many are finished, of how many in all, and the last one.
using ProgressCallback =
    std::function<void(std::size_t done, std::size_t total, const FrameRecord& last)>;

/// Tests whether a part of the scene's pictures can be rendered and merged into these files. Errors
/// (kUsage): adaptive sampling, denoising, PNG.
Status check_part(const Scene& scene, const FrameFiles& files);

/// Renders the frames, or a part of each. Frames one after the other that show the same to the bit
/// (image.steady, and nothing moves) are traced once. Errors: the first failing frame's, unless
/// keep_going.
Result<RunReport> render_sequence(const Scene& scene, const SequenceSettings& settings,
                                  const ProgressCallback& progress);

}  // namespace polymorph
