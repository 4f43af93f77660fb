// Batch scripts for Slurm: a job array that renders a sequence, and a job that completes it.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"

namespace polymorph {

struct SlurmJob {
  std::string name;                          ///< name of the array; the job after it is NAME-finish
  std::string program;                       ///< absolute
  std::string folder;                        ///< absolute: where both scripts run
  std::string log_folder;                    ///< absolute: scripts and logs
  std::string scene, output;                 ///< `output` with a place for the frame number
  std::string frames;                        ///< value of --frames; empty: all
  std::string sheet, movie;                  ///< outputs of the finish job, without extension
  std::vector<std::string> scene_arguments;  ///< to_arguments(), and --png
  std::vector<std::string> render_arguments;  ///< arguments of render alone: cache, device
  std::vector<std::string> directives;        ///< more of sbatch's options, "--partition=big"
  int tasks = 1;
  int cpus = 4;
  int gpus = 0;  ///< GPUs of a task, which share its frames
  int memory_mib = 1024;
  int minutes = 10;
  double frame_seconds = 0;  ///< seconds per frame, on `cpus`; 0: unknown
};

/// Checks that no string of the job has control characters: a line break in the name of a folder
/// would end a directive, and the rest would be a command. Errors: kUsage.
Status check_job(const SlurmJob& job);

/// Number of array tasks: each has at least `task_seconds` of frames where there are enough, and
/// there are at most `max_tasks` of them. `frame_seconds` 0: one frame per task.
int slurm_tasks(std::size_t frames, double frame_seconds, double task_seconds, int max_tasks);

/// The job array: task i of n renders every n-th frame from the i-th on, keeps what is current, and
/// is queued again when it stops early (code 75).
std::string slurm_render_script(const SlurmJob& job);
/// Checks that every frame is whole, then makes the contact sheet and the movie.
std::string slurm_finish_script(const SlurmJob& job);

/// Runs sbatch and returns the job's number. Errors (kResource): there is no sbatch, or it refuses;
/// the message has what it said.
Result<std::string> run_sbatch(const std::vector<std::string>& arguments);

}  // namespace polymorph
