// Slurm job of a scene: estimates its costs, sizes its tasks and submits it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "farm/slurm.h"
#include "image/display_view.h"
#include "scene/scene.h"

namespace polymorph {

/// A job as the user requests it. make_slurm_job() chooses `tasks`, `minutes` and `memory` by the
/// measured costs if they are 0.
struct SlurmRequest {
  std::string scene, output;  ///< scene file; frame pattern (empty: the scene's output.file)
  std::string frames;         ///< value of --frames; empty: all
  bool png = false;           ///< write PNGs besides EXRs
  DisplayView view;           ///< display view of the PNGs
  /// Number of tasks and its maximum; processors and GPUs per task; time limit of a task.
  int tasks = 0, max_tasks = 1000, cpus = 4, gpus = 0, minutes = 0;
  double task_minutes = 2;       ///< minimum rendering time of a task, if there are enough frames
  double frame_seconds = 0;      ///< seconds per frame; 0: measured by a dry run
  std::uint64_t memory = 0;      ///< bytes per task
  std::string device = "auto";   ///< device of the measurement
  std::uint64_t max_memory = 0;  ///< memory limit of the measurement, bytes; 0: no limit
  std::filesystem::path cache_folder;  ///< cache of the measurement; empty: none
  /// Arguments and directives for SlurmJob.
  std::vector<std::string> scene_arguments, render_arguments, directives;
};

/// Makes the job of a scene. Its costs are measured by a dry run, unless `frame_seconds` is given.
/// Errors: those of render_sequence(); kAnswerNo if every frame is current; kUsage for a name with
/// control characters.
Result<SlurmJob> make_slurm_job(const Scene& scene, SlurmRequest request);

/// Slurm's numbers of the array and of the finish job.
struct SubmittedJob {
  std::string array, finish;
};

/// Writes both scripts to the job's log folder and submits them with sbatch.
Result<SubmittedJob> submit_slurm_job(const SlurmJob& job);

}  // namespace polymorph
