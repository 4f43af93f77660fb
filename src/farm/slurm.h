// Batch scripts for Slurm: a job array that renders a sequence, and a job that checks the frames
// and makes a contact sheet and a movie of them.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// The values that both scripts contain.
struct SlurmJob {
  std::string name;           ///< name of the array; the second job is NAME-finish
  std::string program;        ///< absolute path of polymorph
  std::string folder;         ///< absolute path of the folder in which both scripts run
  std::string log_folder;     ///< absolute path of the folder of scripts and logs
  std::string scene, output;  ///< scene file; frame pattern with a place for the number
  std::string frames;         ///< value of --frames; empty: all
  std::string sheet, movie;   ///< paths of the contact sheet and the movie, without extension
  std::vector<std::string> scene_arguments;   ///< settings of the scene as arguments, and --png
  std::vector<std::string> render_arguments;  ///< arguments of `render` only: cache, device
  std::vector<std::string> directives;        ///< further options of sbatch: "--partition=big"
  int tasks = 1;                              ///< tasks of the array
  int cpus = 4;                               ///< processors per task
  int gpus = 0;                               ///< GPUs per task, which share the task's frames
  int memory_mib = 1024;                      ///< memory per task
  int minutes = 10;                           ///< time limit of a task
  double frame_seconds = 0;  ///< seconds per frame on `cpus` processors; 0: unknown
};

/// Checks that no string of the job has control characters. A line break in the name of a folder
/// would end a directive, and the rest would run as a command. Errors: kUsage.
Status check_job(const SlurmJob& job);

/// Computes the number of array tasks, at most `max_tasks`. Each task renders for at least
/// `task_seconds` if there are enough frames. If `frame_seconds` is 0, each task has one frame.
int slurm_tasks(std::size_t frames, double frame_seconds, double task_seconds, int max_tasks);

/// Returns the script of the job array. Task i of n renders every n-th frame from the i-th on,
/// skips frames that are current, and is requeued if it stops early (exit code 75).
std::string slurm_render_script(const SlurmJob& job);
/// Returns the script that checks that every frame is complete, and then makes the contact sheet
/// and the movie.
std::string slurm_finish_script(const SlurmJob& job);

/// Runs sbatch and returns the job's number. Errors (kResource): sbatch is missing or fails; the
/// message includes the output of sbatch.
Result<std::string> run_sbatch(const std::vector<std::string>& arguments);

}  // namespace polymorph
