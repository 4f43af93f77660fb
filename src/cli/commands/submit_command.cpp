#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <system_error>

#include "base/file.h"
#include "base/log.h"
#include "cli/command_line.h"
#include "cli/scene_options.h"
#include "cli/slurm.h"
#include "morph/timeline.h"
#include "sequence/run/render_sequence.h"
#include "sequence/run/status.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

struct SubmitOptions {
  std::string engine, scene, output, frames, partition, account;
  std::vector<std::string> directives;
  bool png = false, print = false;
  int tasks = 0, max_tasks = 1000, cpus = 4, minutes = 0;
  double task_minutes = 2, frame_seconds = 0;
  std::uint64_t memory = 0;
  SceneOptions scene_options;
};

/// The pattern as parse_pattern() reads it.
std::string to_text(const FramePattern& pattern) {
  std::string text;
  for (const char c : pattern.before) text += c == '%' ? std::string("%%") : std::string(1, c);
  text += std::string(static_cast<std::size_t>(pattern.digits), '#');
  for (const char c : pattern.after) text += c == '%' ? std::string("%%") : std::string(1, c);
  return text;
}

/// Costs of the job: measured here by a dry run, unless the command line gives them all.
struct Costs {
  std::size_t frames = 0;                         ///< number still to be rendered
  double frame_seconds = 0, prepare_seconds = 0;  ///< seconds on the task's processors
  std::uint64_t memory = 0;
};

Result<Costs> measure_costs(const CommandLine& line, const SubmitOptions& options,
                            const Scene& scene, const FrameFiles& files) {
  SequenceSettings settings;
  const int count = frame_count(scene);
  PM_TRY(
      settings.frames,
      parse_frames(options.frames.empty() ? fmt::format("1-{}", count) : options.frames, 1, count));
  Costs costs;
  if (options.frame_seconds > 0) {
    PM_TRY(const ExpectedHashes hashes, expected_hashes(scene, settings.frames));
    const auto states = frame_states(files, settings.frames, hashes.frames);
    costs.frames = settings.frames.size() - static_cast<std::size_t>(std::count(
                                                states.begin(), states.end(), FileState::kWhole));
    costs.frame_seconds = options.frame_seconds;
    return costs;
  }
  settings.exr = files.exr;
  settings.png = files.png;
  settings.existing = Existing::kSkip;
  settings.dry_run = true;
  settings.device = line.common.device;
  settings.max_memory = line.common.max_memory;
  settings.isa = options.scene_options.isa;
  settings.cache_folder = cache_folder(line.common);
  settings.stop = &stop_requested();
  log_info("measuring frames here; --frame-seconds saves it");
  PM_TRY(const RunReport report, render_sequence(scene, settings, nullptr));
  if (report.stopped) return make_error(stop_code(), "stopped - nothing was submitted");
  // Frames are traced by all processors, and almost all of their time is that.
  const double fewer = static_cast<double>(report.threads) / options.cpus;
  costs.frames = report.count(FrameRecord::State::kPlanned);
  costs.frame_seconds = report.estimate->seconds * fewer;
  costs.prepare_seconds = (report.prepare_seconds + report.estimate->fit_seconds) * fewer;
  costs.memory = std::max(report.peak_memory, report.estimate->memory);
  return costs;
}

/// Sizes the job with a margin: three times the time, half as much memory again.
void size_job(SlurmJob& job, const SubmitOptions& options, const Costs& costs) {
  constexpr double kMebibyte = 1024.0 * 1024.0;
  constexpr int kMinMinutes = 10, kMinMemory = 1024, kMemoryStep = 256;
  job.tasks = options.tasks > 0
                  ? std::min(options.tasks, std::max(1, static_cast<int>(costs.frames)))
                  : slurm_tasks(costs.frames, costs.frame_seconds, 60 * options.task_minutes,
                                options.max_tasks);
  job.frame_seconds = costs.frame_seconds;
  const double frames = std::ceil(static_cast<double>(costs.frames) / job.tasks);
  const double seconds = costs.prepare_seconds + frames * costs.frame_seconds;
  job.minutes = options.minutes > 0
                    ? options.minutes
                    : std::max(kMinMinutes, static_cast<int>(std::ceil(3 * seconds / 60)));
  const auto bytes =
      static_cast<double>(options.memory > 0 ? options.memory : costs.memory * 3 / 2);
  const int mebibytes = static_cast<int>(std::ceil(bytes / kMebibyte));
  job.memory_mib =
      options.memory > 0
          ? std::max(1, mebibytes)
          : std::max(kMinMemory, (mebibytes + kMemoryStep - 1) / kMemoryStep * kMemoryStep);
}

Result<SlurmJob> make_job(const CommandLine& line, const SubmitOptions& options, const Scene& scene,
                          const std::string& output) {
  PM_TRY(const FrameFiles files, frame_files(scene, output, options.png, true));
  std::error_code error;
  SlurmJob job;
  job.program = fs::read_symlink("/proc/self/exe", error).string();
  if (error) return make_error(ErrorCode::kResource, "/proc/self/exe: {}", error.message());
  job.name = fs::path(options.scene).stem().string();
  job.folder = fs::current_path(error).string();
  const fs::path frames = (fs::path(job.folder) / output).lexically_normal().parent_path();
  job.log_folder = (frames / "slurm").string();
  job.scene = options.scene;
  job.output = to_text(files.exr.has_number() ? files.exr : files.png);
  job.frames = options.frames;
  job.sheet = (frames / "strip").string();
  job.movie = (frames / job.name).string();
  job.cpus = options.cpus;
  job.scene_arguments = to_arguments(options.scene_options);
  if (options.png) job.scene_arguments.emplace_back("--png");
  const auto add = [&](const char* name, const std::string& value) {
    if (value.empty()) return;
    job.render_arguments.emplace_back(name);
    job.render_arguments.push_back(value);
  };
  add("--cache-dir", line.common.cache_dir);
  if (line.common.no_cache) job.render_arguments.emplace_back("--no-cache");
  if (line.common.device != "auto") add("--device", line.common.device);
  if (!options.partition.empty()) job.directives.push_back("--partition=" + options.partition);
  if (!options.account.empty()) job.directives.push_back("--account=" + options.account);
  job.directives.insert(job.directives.end(), options.directives.begin(), options.directives.end());
  PM_TRY_STATUS(check_job(job));
  PM_TRY(const Costs costs, measure_costs(line, options, scene, files));
  if (costs.frames == 0)
    return make_error(ErrorCode::kAnswerNo, "every frame is there and current - nothing to submit");
  size_job(job, options, costs);
  log_info("{} frames in {} task{}: {} a frame, {} to prepare, on {} processors each", costs.frames,
           job.tasks, job.tasks == 1 ? "" : "s", format_seconds(costs.frame_seconds),
           format_seconds(costs.prepare_seconds), job.cpus);
  return job;
}

Result<int> run_submit(const CommandLine& line, const SubmitOptions& options) {
  PM_TRY(const Scene scene, load_scene_with(options.scene, options.scene_options));
  const std::string output = options.output.empty() ? scene.output.file : options.output;
  PM_TRY(const SlurmJob job, make_job(line, options, scene, output));
  const std::string render = slurm_render_script(job), finish = slurm_finish_script(job);
  if (options.print) {
    print_data("{}\n{}", render, finish);
    return 0;
  }
  const fs::path folder = job.log_folder;
  // The scripts are this command's own, and a job keeps the copy that it was submitted with.
  PM_TRY_STATUS(write_files({{folder / "render.sh", render}, {folder / "finish.sh", finish}}));
  PM_TRY(const std::string array, run_sbatch({(folder / "render.sh").string()}));
  PM_TRY(const std::string after,
         run_sbatch({"--dependency=afterany:" + array, (folder / "finish.sh").string()}));
  print_data("{}\n{}\n", array, after);
  log_info(
      "submitted the array {} and, after it, {}; scripts and logs: {}\nwatch it with:\n"
      "  squeue -j {},{}\n  {} status {} {}",
      array, after, folder.string(), array, after, line.program, quote_for_shell(output),
      quote_for_shell(options.scene));
  return 0;
}

void add_farm_options(Command command, SubmitOptions& options) {
  const auto add = [](Option option) { option.group("Farm"); };
  add(command.add_option("--tasks", options.tasks, "tasks of the array; default: by time")
          .range(1, 100000)
          .type_name("N"));
  add(command
          .add_option("--task-minutes", options.task_minutes,
                      "frames for at least so long in each task (2)")
          .range(0.01, 10000.0)
          .type_name("M"));
  add(command
          .add_option("--max-tasks", options.max_tasks,
                      "maximum number of tasks of the array (1000)")
          .range(1, 100000)
          .type_name("N"));
  add(command
          .add_option("--frame-seconds", options.frame_seconds,
                      "take this for a frame's time and measure nothing")
          .range(0.0, 1e6)
          .type_name("S"));
  add(command.add_option("--cpus", options.cpus, "processors of a task (4)")
          .range(1, 4096)
          .type_name("N"));
  add(command.add_option("--mem", options.memory, "memory of a task; default: by what is measured")
          .bytes()
          .type_name("SIZE"));
  add(command.add_option("--minutes", options.minutes, "time limit of a task; default: by time")
          .range(1, 1000000)
          .type_name("M"));
  add(command.add_option("--partition", options.partition, "partition that the jobs go to")
          .type_name("NAME"));
  add(command.add_option("--account", options.account, "account that is charged")
          .type_name("NAME"));
  add(command
          .add_option("--sbatch", options.directives,
                      "one more option of sbatch: --sbatch=--qos=night")
          .type_name("OPTION")
          .one_value_each());
}

}  // namespace

void add_submit(CommandLine& line) {
  auto options = std::make_shared<SubmitOptions>();
  Command command = add_command(
      line, "submit", "Render a scene on a farm: a job array, and a job that completes it.",
      "  polymorph submit slurm scene.json -o 'out/frame.####.exr' --print\n"
      "  polymorph submit slurm scene.json -o 'out/f.####.exr' --cpus 8 --partition day",
      "  0 submitted or printed   1 nothing is left to render   2 usage\n"
      "  3 bad scene or model   4 cannot write   5 no sbatch, or it refuses\n"
      "  75, 130, 143 stopped by a signal");
  command.add_option("engine", options->engine, "slurm")
      .required()
      .choices({"slurm"})
      .type_name("ENGINE")
      .group("Main");
  command.add_option("scene", options->scene, "the scene file")
      .required()
      .type_name("SCENE")
      .group("Main");
  command
      .add_option("-o,--output", options->output,
                  "frame.####.exr or .png on storage that all machines share")
      .type_name("FILE")
      .group("Main");
  command.add_option("-f,--frames", options->frames, "these frames alone; default: all")
      .type_name("LIST")
      .group("Main");
  command.add_flag("--png", options->png, "a PNG beside each EXR").group("Main");
  command.add_flag("--print", options->print, "print both scripts and submit nothing")
      .group("Main");
  add_scene_options(command, options->scene_options);
  add_farm_options(command, *options);
  set_action(line, command, [&line, options] { return run_submit(line, *options); });
}

}  // namespace polymorph
