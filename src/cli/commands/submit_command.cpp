#include "base/log.h"
#include "cli/command_line.h"
#include "cli/scene_options.h"
#include "farm/slurm_job.h"

namespace polymorph {
namespace {

struct SubmitOptions {
  std::string scheduler;  ///< always "slurm", the only scheduler that is supported
  bool print = false;
  SlurmRequest job;
  SceneOptions scene_options;
};

Result<int> run_submit(const CommandLine& line, const SubmitOptions& options) {
  PM_TRY(const Scene scene, load_scene_with(options.job.scene, options.scene_options));
  SlurmRequest request = options.job;
  request.device = line.common.device;
  request.max_memory = line.common.max_memory;
  request.cache_folder = cache_folder(line.common);
  request.scene_arguments = to_arguments(options.scene_options);
  request.view = options.scene_options.view;
  std::vector<std::string>& arguments = request.render_arguments;
  if (!line.common.cache_dir.empty())
    arguments.insert(arguments.end(), {"--cache-dir", line.common.cache_dir});
  if (line.common.no_cache) arguments.emplace_back("--no-cache");
  if (request.gpus > 0)
    arguments.insert(arguments.end(), {"--device", "cuda:all"});
  else if (request.device != "auto")
    arguments.insert(arguments.end(), {"--device", request.device});
  PM_TRY(const SlurmJob job, make_slurm_job(scene, request));
  if (options.print) {
    print_data("{}\n{}", slurm_render_script(job), slurm_finish_script(job));
    return 0;
  }
  PM_TRY(const SubmittedJob submitted, submit_slurm_job(job));
  print_data("{}\n{}\n", submitted.array, submitted.finish);
  log_info(
      "submitted the array {0} and, after it, {1}; scripts and logs: {2}\nwatch it with:\n"
      "  squeue -j {0},{1}\n  {3} status {4} {5}",
      submitted.array, submitted.finish, job.log_folder, line.program,
      quote_for_shell(request.output.empty() ? scene.output.file : request.output),
      quote_for_shell(request.scene));
  return 0;
}

/// Adds the options for the job array, in the group Farm.
void add_farm_options(Command command, SlurmRequest& job) {
  const auto add = [](Option option) { option.group("Farm"); };
  add(command
          .add_option("--tasks", job.tasks, "N",
                      "tasks of the array; default: by the measured time per frame")
          .range(1, 100000));
  add(command
          .add_option("--task-minutes", job.task_minutes, "M",
                      "minimum time that the frames of a task take, in minutes (2)")
          .range(0.01, 10000.0));
  add(command
          .add_option("--max-tasks", job.max_tasks, "N",
                      "maximum number of tasks of the array (1000)")
          .range(1, 100000));
  add(command
          .add_option("--frame-seconds", job.frame_seconds, "S",
                      "take this for a frame's time and measure nothing")
          .range(0.0, 1e6));
  add(command.add_option("--cpus", job.cpus, "N", "processors of a task (4)").range(1, 4096));
  add(command.add_option("--gpus", job.gpus, "N", "GPUs of a task, which share its frames (0)")
          .range(0, 1024));
  add(command
          .add_option("--mem", job.memory, "SIZE", "memory of a task; default: by what is measured")
          .bytes());
  add(command
          .add_option("--minutes", job.minutes, "M",
                      "time limit of a task; default: by the measured time per frame")
          .range(1, 1000000));
  add(command
          .add_option("--sbatch", job.directives, "OPTION",
                      "one more option of sbatch: --sbatch=--partition=day")
          .one_value_each());
}

}  // namespace

void add_submit(CommandLine& line) {
  auto options = std::make_shared<SubmitOptions>();
  Command command = add_command(
      line, "submit", "Render a scene on a farm: a job array, and a job that completes it.",
      "  polymorph submit slurm scene.json -o 'out/frame.####.exr' --print\n"
      "  polymorph submit slurm scene.json -o 'out/f.####.exr' --cpus 8 --sbatch=--partition=day",
      "  0 submitted or printed   1 nothing is left to render   2 usage\n"
      "  3 bad scene or model   4 cannot write   5 no sbatch, or it refuses\n"
      "  75, 130, 143 stopped by a signal");
  command.add_option("engine", options->scheduler, "ENGINE", "slurm").required().choices({"slurm"});
  command.add_option("scene", options->job.scene, "SCENE", "the scene file").required();
  command.add_option("-o,--output", options->job.output, "FILE",
                     "frame.####.exr or .png on storage that all machines share");
  command.add_option("-f,--frames", options->job.frames, "LIST",
                     "these frames alone; default: all");
  command.add_flag("--png", options->job.png, "a PNG beside each EXR");
  command.add_flag("--print", options->print, "print both scripts and submit nothing");
  add_scene_options(command, options->scene_options);
  add_farm_options(command, options->job);
  set_action(line, command, [&line, options] { return run_submit(line, *options); });
}

}  // namespace polymorph
