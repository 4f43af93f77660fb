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

/// A job as the user requests it. If `tasks`, `minutes` or `memory` is 0, make_slurm_job() chooses
/// it by the measured costs.
struct SlurmRequest {
  std::string scene, output;  ///< scene file; frame pattern (empty: the scene's output.file)
  std::string frames;         ///< value of --frames; empty: all
  bool png = false;           ///< write PNGs besides EXRs
  DisplayView view;           ///< display view of the PNGs
  /// `tasks`, `max_tasks`: number of tasks and its maximum; `cpus`, `gpus`: per task; `minutes`:
  /// time limit of a task.
  int tasks = 0, max_tasks = 1000, cpus = 4, gpus = 0, minutes = 0;
  double task_minutes = 2;       ///< minimum rendering time of a task, if there are enough frames
  double frame_seconds = 0;      ///< seconds per frame; 0: measured by a dry run
  std::uint64_t memory = 0;      ///< bytes per task
  std::string device = "auto";   ///< device of the measurement if `gpus` > 0; otherwise it is cpu
  std::uint64_t max_memory = 0;  ///< memory limit of the measurement, bytes; 0: no limit
  std::filesystem::path cache_folder;  ///< cache of the measurement; empty: none
  /// Arguments and directives for SlurmJob.
  std::vector<std::string> scene_arguments, render_arguments, directives;
};

/// Makes the job of a scene. A dry run measures the costs, unless `frame_seconds` is given. Errors:
/// those of render_sequence(); kAnswerNo if every frame is current; kUsage for a name with control
/// characters.
Result<SlurmJob> make_slurm_job(const Scene& scene, SlurmRequest request);

/// Slurm's numbers of the array and of the job that runs slurm_finish_script().
struct SubmittedJob {
  std::string array, finish;
};

/// Writes both scripts to the job's log folder and submits them with sbatch. Errors: those of
/// write_files() and run_sbatch().
Result<SubmittedJob> submit_slurm_job(const SlurmJob& job);

}  // namespace polymorph
