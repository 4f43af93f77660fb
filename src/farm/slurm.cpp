#include "farm/slurm.h"

#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "base/shell_quote.h"
#include "base/text.h"

namespace polymorph {
namespace {

/// Computes how many seconds before the time limit a task gets the signal to stop: the time of the
/// frames that may be in progress, four on a GPU and three without, but at least 90 seconds and at
/// most half of the limit.
int signal_seconds(const SlurmJob& job) {
  constexpr double kMinSeconds = 90;
  const double frames_in_progress = job.gpus > 0 ? 4 : 3;
  const double finish_seconds = std::ceil(frames_in_progress * job.frame_seconds);
  // 30.0 * minutes: half of the time limit, in seconds.
  return static_cast<int>(std::min(std::max(kMinSeconds, finish_seconds), 30.0 * job.minutes));
}

/// Returns the first lines of a script, with the directives that both jobs share. `log` is the name
/// of the log file, in which Slurm replaces %x (name of the job), %A and %j (its number) and %a
/// (number of the task).
std::string script_head(const SlurmJob& job, const std::string& name, const std::string& log) {
  std::string out = "#!/bin/bash\n";
  const auto directive = [&](const std::string& text) { out += "#SBATCH " + text + "\n"; };
  directive("--job-name=" + quote_for_shell(name));
  directive("--chdir=" + quote_for_shell(job.folder));
  directive("--output=" + quote_for_shell(job.log_folder + "/" + log));
  directive("--open-mode=append");
  directive(fmt::format("--cpus-per-task={}", job.cpus));
  directive(fmt::format("--mem={}M", job.memory_mib));
  directive(fmt::format("--time={}", job.minutes));
  for (const std::string& text : job.directives) directive(text);
  return out;
}

/// Returns the arguments, quoted, with a space before each.
std::string quote_arguments(const std::vector<std::string>& arguments) {
  std::string out;
  for (const std::string& word : arguments) out.append(1, ' ').append(quote_for_shell(word));
  return out;
}

std::string frames_argument(const SlurmJob& job) {
  return job.frames.empty() ? "" : quote_arguments({"--frames", job.frames});
}

}  // namespace

Status check_job(const SlurmJob& job) {
  std::vector<std::string> texts{job.name,   job.program, job.folder, job.log_folder, job.scene,
                                 job.output, job.frames,  job.sheet,  job.movie};
  for (const auto* list : {&job.scene_arguments, &job.render_arguments, &job.directives})
    texts.insert(texts.end(), list->begin(), list->end());
  for (const std::string& text : texts)
    for (const char c : text)
      if (static_cast<unsigned char>(c) < ' ' || c == 127)  // 127: DEL
        return make_error(ErrorCode::kUsage,
                          "{}: a job script cannot hold a control character, such as a line break "
                          "- rename the file or folder, or change the option",
                          text);
  return Ok{};
}

int slurm_tasks(std::size_t frames, double frame_seconds, double task_seconds, int max_tasks) {
  const double frames_per_task =
      frame_seconds > 0 ? std::max(1.0, std::ceil(task_seconds / frame_seconds)) : 1.0;
  const double tasks = std::floor(static_cast<double>(frames) / frames_per_task);
  return static_cast<int>(std::clamp(tasks, 1.0, static_cast<double>(max_tasks)));
}

std::string slurm_render_script(const SlurmJob& job) {
  std::string out = script_head(job, job.name, "%x-%A_%a.log");
  out += fmt::format("#SBATCH --array=1-{}\n#SBATCH --requeue\n#SBATCH --signal=B:USR1@{}\n",
                     job.tasks, signal_seconds(job));
  if (job.gpus > 0)
    out += fmt::format("#SBATCH --ntasks=1\n#SBATCH --gpus-per-task={}\n", job.gpus);
  out += fmt::format(
      "# Made by polymorph submit. Every task renders its share and keeps what is current, so "
      "that\n"
      "# any of them may be run again at any time.\n"
      "{} render {} -o {}{}{} \\\n"
      "  --shard \"$SLURM_ARRAY_TASK_ID/{}\" --skip-existing --progress lines \\\n"
      "  --threads \"$SLURM_CPUS_PER_TASK\" &\n",
      quote_for_shell(job.program), quote_for_shell(job.scene), quote_for_shell(job.output),
      frames_argument(job) + quote_arguments(job.scene_arguments),
      quote_arguments(job.render_arguments), job.tasks);
  // In bash, `wait` returns early when a trap runs, so it is repeated until the child has ended.
  out +=
      "child=$!\n"
      "# Slurm tells the script alone that its time is nearly up.\n"
      "trap 'kill -USR1 \"$child\"' USR1\n"
      "trap 'kill -TERM \"$child\"' TERM\n"
      "wait \"$child\"\n"
      "while kill -0 \"$child\" 2>/dev/null; do wait \"$child\"; done\n"
      "wait \"$child\"\n"
      "code=$?\n"
      "# 75: stopped early, and all finished frames are whole. The rest is rendered in another "
      "turn.\n"
      "if [ \"$code\" -eq 75 ]; then\n"
      "  scontrol requeue \"${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}\"\n"
      "fi\n"
      "exit \"$code\"\n";
  return out;
}

std::string slurm_finish_script(const SlurmJob& job) {
  std::string out = script_head(job, job.name + "-finish", "%x-%j.log");
  const std::string program = quote_for_shell(job.program), output = quote_for_shell(job.output);
  out += fmt::format(
      "# Made by polymorph submit. Runs when every task of the array has ended, well or not.\n"
      "set -e\n"
      "{0} status {1} {2}{3}\n"
      "{0} strip {1} -c 12 --width 320 -o {4} --overwrite\n"
      "if command -v ffmpeg >/dev/null; then\n"
      "  {0} strip {1} --mp4 {5} --overwrite\n"
      "else\n"
      "  {0} strip {1} --width 320 --gif {6} --overwrite\n"
      "fi\n",
      program, output, quote_for_shell(job.scene),
      frames_argument(job) + quote_arguments(job.scene_arguments),
      quote_for_shell(job.sheet + ".png"), quote_for_shell(job.movie + ".mp4"),
      quote_for_shell(job.movie + ".gif"));
  return out;
}

Result<std::string> run_sbatch(const std::vector<std::string>& arguments) {
  const std::string command = "sbatch --parsable" + quote_arguments(arguments) + " 2>&1";
  FILE* pipe = ::popen(command.c_str(), "r");
  if (!pipe) return make_error(ErrorCode::kResource, "sbatch: cannot be started");
  std::string output;
  std::array<char, 512> buffer{};
  while (std::fgets(buffer.data(), static_cast<int>(buffer.size()), pipe)) output += buffer.data();
  const int status = ::pclose(pipe);
  while (!output.empty() && (output.back() == '\n' || output.back() == '\r')) output.pop_back();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return make_error(ErrorCode::kResource,
                      "{}: {} - run this on a machine of the cluster, or see the scripts with "
                      "--print",
                      command, output.empty() ? "failed" : output);
  // The last line is "1234" or "1234;cluster"; a site's own sbatch may print other lines before it.
  const auto lines = split(output, '\n');
  return lines.back().substr(0, lines.back().find(';'));
}

}  // namespace polymorph
