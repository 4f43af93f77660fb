// Slurm job of a scene: its costs, its tasks and its submission.
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

/// A job that is asked for; zeros are chosen by the costs.
struct SlurmRequest {
  std::string scene, output;  ///< the scene's file; a pattern, or empty: the scene's own
  std::string frames;         ///< value of --frames; empty: all
  bool png = false;
  DisplayView view;  ///< view by which PNGs are made
  int tasks = 0, max_tasks = 1000, cpus = 4, gpus = 0, minutes = 0;
  double task_minutes = 2;
  double frame_seconds = 0;  ///< 0: measured here
  std::uint64_t memory = 0;
  std::string device = "auto";   ///< device of the measurement
  std::uint64_t max_memory = 0;  ///< limit of the measurement
  std::filesystem::path cache_folder;
  std::vector<std::string> scene_arguments, render_arguments, directives;  ///< those of SlurmJob
};

/// Costs are measured by a dry run, unless a frame's seconds are given. Errors: those of
/// render_sequence(); kAnswerNo: every frame is current; kUsage: a name no script can hold.
Result<SlurmJob> make_slurm_job(const Scene& scene, SlurmRequest request);

/// Numbers of the array and of the job after it.
struct SubmittedJob {
  std::string array, finish;
};

/// Writes both scripts into the job's log folder and hands them to sbatch.
Result<SubmittedJob> submit_slurm_job(const SlurmJob& job);

}  // namespace polymorph
