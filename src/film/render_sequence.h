// Rendering of a frame sequence to files, with resuming, progress and a report.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/result.h"
#include "film/run_report.h"
#include "image/display_view.h"
#include "image/image.h"
#include "kernels/engine.h"
#include "render/sample_range.h"
#include "scene/scene.h"

namespace polymorph {

/// Treatment of files that exist. kRefuse: they are an error. kSkip: frames whose files are current
/// (film/status.h) are not rendered. kOverwrite: all frames are rendered.
enum class Existing { kRefuse, kSkip, kOverwrite };

/// Settings of render_sequence().
struct SequenceSettings {
  std::vector<int> frames;          ///< frame numbers in rendering order; not empty
  FramePattern exr;                 ///< empty: no EXR files
  FramePattern png;                 ///< empty: no PNG files
  DisplayView view;                 ///< view of PNG files
  std::optional<SampleRange> part;  ///< samples to render; empty: all
  Existing existing = Existing::kRefuse;
  bool strict = false;      ///< warnings about the scene's files are errors
  bool keep_going = false;  ///< a failed frame does not stop the others
  bool dry_run = false;     ///< render and write nothing; estimate the cost
  /// Number of frames that are traced at once; as many may be written at once. On the CPU the
  /// surface of one more frame is made meanwhile; on GPUs each tracer makes the surfaces of its
  /// frames. 0: cpu_jobs(), on GPUs the larger of that and gpu_jobs().
  int jobs = 1;
  std::string device = "auto";         ///< one device or a list (list_devices())
  std::size_t max_memory = 0;          ///< maximum bytes of the whole run; 0: no limit
  std::filesystem::path cache_folder;  ///< empty: none
  std::string command;                 ///< command line that the image headers state
  /// Set by the caller (a signal handler) to stop after the frames in progress.
  const std::atomic<bool>* stop = nullptr;
};

/// Returns the number of frames to trace at once on `devices` GPUs: two to four per GPU, depending
/// on the number of CPU threads.
int gpu_jobs(int devices);

/// Returns the number of frames of `width` x `height` pixels to trace at once on the CPU, so that
/// every thread has enough tiles.
int cpu_jobs(int width, int height, std::size_t frames);

/// Callback after each frame. `done`: number of frames that are finished (rendered, skipped or
/// failed), of `total`; `last`: the frame that was just finished.
using ProgressCallback =
    std::function<void(std::size_t done, std::size_t total, const FrameRecord& last)>;

/// Checks that parts of the scene's pictures can be rendered to these files. Errors: kUsage if the
/// scene uses adaptive sampling or denoising, or if a file is a PNG.
Status check_part(const Scene& scene, const FrameFiles& files);

/// Renders the frames, or a part of each. Consecutive frames with bit-identical pixels
/// (picture_key()) are traced once. Errors: the error of the first frame that fails, unless
/// keep_going.
Result<RunReport> render_sequence(const Scene& scene, const SequenceSettings& settings,
                                  const ProgressCallback& progress);

}  // namespace polymorph
