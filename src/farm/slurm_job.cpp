#include "farm/slurm_job.h"

#include <algorithm>
#include <cmath>
#include <system_error>

#include "base/file.h"
#include "base/frames.h"
#include "base/log.h"
#include "base/plural.h"
#include "base/stop.h"
#include "base/text.h"
#include "film/frame_files.h"
#include "film/render_sequence.h"
#include "film/status.h"
#include "morph/timeline.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Formats a pattern so that parse_pattern() reads it: with hashes for digits and "%%" for "%".
std::string to_text(const FramePattern& pattern) {
  std::string text;
  for (const char c : pattern.before) text += c == '%' ? std::string("%%") : std::string(1, c);
  text += std::string(static_cast<std::size_t>(pattern.digits), '#');
  for (const char c : pattern.after) text += c == '%' ? std::string("%%") : std::string(1, c);
  return text;
}

/// Costs of the job.
struct Costs {
  std::size_t frames = 0;  ///< number of frames that are not current
  /// Time per frame and of the preparation, on the processors of one task; 0: not measured.
  double frame_seconds = 0, prepare_seconds = 0;
  std::uint64_t memory = 0;  ///< peak bytes; 0: not measured
};

/// Counts the frames to render. Measures the time and memory by a dry run, unless the request gives
/// the seconds per frame.
Result<Costs> measure_costs(const SlurmRequest& request, const Scene& scene,
                            const FrameFiles& files) {
  SequenceSettings settings;
  const int count = frame_count(scene);
  PM_TRY(settings.frames, parse_frames_or_all(request.frames, /*first=*/1, count));
  Costs costs;
  // If the time per frame is given, only count the frames that are not current.
  if (request.frame_seconds > 0) {
    PM_TRY(ExpectedHashes hashes, expected_hashes(scene, settings.frames));
    hashes.view = request.view;
    const auto states = frame_states(files, settings.frames, hashes);
    costs.frames = settings.frames.size() - static_cast<std::size_t>(std::count(
                                                states.begin(), states.end(), FileState::kCurrent));
    costs.frame_seconds = request.frame_seconds;
    return costs;
  }
  // Measure by a dry run.
  settings.exr = files.exr;
  settings.png = files.png;
  settings.view = request.view;
  settings.existing = Existing::kSkip;
  settings.dry_run = true;
  settings.device = request.gpus > 0 ? request.device : "cpu";
  settings.max_memory = request.max_memory;
  settings.cache_folder = request.cache_folder;
  settings.stop = &stop_requested();
  log_info("measuring frames here; --frame-seconds says their time instead");
  PM_TRY(const RunReport report, render_sequence(scene, settings, /*progress=*/nullptr));
  if (report.stopped) return make_error(stop_code(), "stopped - nothing was submitted");
  // Preparation scales with the number of CPUs, and so do frames that are not traced on a GPU.
  const double thread_ratio = static_cast<double>(report.threads) / request.cpus;
  costs.frames = report.count(FrameRecord::State::kPlanned);
  costs.frame_seconds = report.estimate->seconds * (report.device == "cpu" ? thread_ratio : 1);
  costs.prepare_seconds = (report.prepare_seconds + report.estimate->fit_seconds) * thread_ratio;
  costs.memory = std::max(report.peak_memory, report.estimate->memory);
  return costs;
}

/// Sets the job's tasks, time limit and memory. Values that the request does not give get a margin:
/// 3 times the measured time and 1.5 times the measured memory.
void size_job(SlurmJob& job, const SlurmRequest& request, const Costs& costs) {
  constexpr double kMebibyte = 1024.0 * 1024.0;
  constexpr int kMinMinutes = 10, kMinMemory = 1024, kMemoryStep = 256;  // memory in MiB
  job.tasks = request.tasks > 0
                  ? std::min(request.tasks, std::max(1, static_cast<int>(costs.frames)))
                  : slurm_tasks(costs.frames, costs.frame_seconds, 60 * request.task_minutes,
                                request.max_tasks);
  job.frame_seconds = costs.frame_seconds;
  const double frames_per_task = std::ceil(static_cast<double>(costs.frames) / job.tasks);
  const double seconds = costs.prepare_seconds + frames_per_task * costs.frame_seconds;
  job.minutes = request.minutes > 0
                    ? request.minutes
                    : std::max(kMinMinutes, static_cast<int>(std::ceil(3 * seconds / 60)));
  const auto bytes =
      static_cast<double>(request.memory > 0 ? request.memory : costs.memory * 3 / 2);
  const int mebibytes = static_cast<int>(std::ceil(bytes / kMebibyte));
  job.memory_mib =
      request.memory > 0
          ? std::max(1, mebibytes)
          : std::max(kMinMemory, (mebibytes + kMemoryStep - 1) / kMemoryStep * kMemoryStep);
}

}  // namespace

Result<SlurmJob> make_slurm_job(const Scene& scene, SlurmRequest request) {
  if (request.output.empty()) request.output = scene.output.file;
  PM_TRY(const FrameFiles files,
         frame_files(scene, request.output, request.png, /*is_sequence=*/true));
  std::error_code error;
  SlurmJob job;
  job.program = fs::read_symlink("/proc/self/exe", error).string();
  if (error) return make_error(ErrorCode::kResource, "/proc/self/exe: {}", error.message());
  job.name = fs::path(request.scene).stem().string();
  job.folder = fs::current_path(error).string();
  if (error)
    return make_error(ErrorCode::kResource, "the current folder is gone: {}", error.message());
  const fs::path frame_folder =
      (fs::path(job.folder) / request.output).lexically_normal().parent_path();
  job.log_folder = (frame_folder / "slurm").string();
  job.scene = request.scene;
  job.output = to_text(files.exr.has_number() ? files.exr : files.png);
  job.frames = request.frames;
  job.sheet = (frame_folder / "strip").string();
  job.movie = (frame_folder / job.name).string();
  job.cpus = request.cpus;
  job.gpus = request.gpus;
  job.scene_arguments = request.scene_arguments;
  if (request.png) job.scene_arguments.emplace_back("--png");
  job.render_arguments = request.render_arguments;
  job.directives = request.directives;
  PM_TRY_STATUS(check_job(job));
  PM_TRY(const Costs costs, measure_costs(request, scene, files));
  if (costs.frames == 0)
    return make_error(ErrorCode::kAnswerNo, "every frame is there and current - nothing to submit");
  size_job(job, request, costs);
  log_info("{} frames in {}: {} a frame, {} to prepare, on {} processors each", costs.frames,
           plural(job.tasks, "task"), format_seconds(costs.frame_seconds),
           format_seconds(costs.prepare_seconds), job.cpus);
  return job;
}

Result<SubmittedJob> submit_slurm_job(const SlurmJob& job) {
  const fs::path folder = job.log_folder;
  const fs::path render = folder / "render.sh", finish = folder / "finish.sh";
  // Existing scripts may be overwritten: Slurm keeps a copy of a script that was submitted.
  PM_TRY_STATUS(
      write_files({{render, slurm_render_script(job)}, {finish, slurm_finish_script(job)}}));
  SubmittedJob submitted;
  PM_TRY(submitted.array, run_sbatch({render.string()}));
  PM_TRY(submitted.finish,
         run_sbatch({"--dependency=afterany:" + submitted.array, finish.string()}));
  return submitted;
}

}  // namespace polymorph
