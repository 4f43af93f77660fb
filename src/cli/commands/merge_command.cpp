#include "base/json.h"
#include "base/log.h"
#include "base/plural.h"
#include "base/stop.h"
#include "base/stopwatch.h"
#include "base/text.h"
#include "cli/command_line.h"
#include "cli/progress.h"
#include "farm/merge_frames.h"
#include "film/part_files.h"

namespace polymorph {
namespace {

struct MergeOptions {
  MergeSettings settings;
  JsonOutput json;
};

/// Formats the samples that a frame's parts have, as RANGE, RANGE.../TOTAL: "0-15, 32-47/64".
std::string describe_samples(const FrameMerge& merge) {
  return fmt::format("{}/{}", format_samples(merge.ranges), merge.samples.total);
}

JsonValue to_json(const std::vector<FrameMerge>& merges) {
  JsonValue json{{"frames", JsonValue::array()}};
  for (const FrameMerge& merge : merges) {
    JsonValue parts = JsonValue::array();
    for (const auto& part : merge.parts) parts.push_back(part.string());
    json["frames"].push_back({{"frame", merge.frame},
                              {"samples", describe_samples(merge)},
                              {"parts", parts},
                              {"file", merge.output.string()}});
  }
  return json;
}

Result<int> run_merge(const CommandLine& line, const MergeOptions& options) {
  const Stopwatch stopwatch;
  MergeSettings settings = options.settings;
  settings.overwrite = line.common.overwrite;
  settings.command = line.arguments;
  PM_TRY(const std::vector<FrameMerge> merges, plan_merge(settings));
  const ProgressCallback progress = make_progress(progress_mode(line.common));
  std::size_t done = 0, parts = 0;  // numbers of merged frames and of their parts
  for (const FrameMerge& merge : merges) {
    if (stop_requested()) {
      log_warning("stopped; merged frames are whole");
      return static_cast<int>(stop_code());
    }
    const Stopwatch frame_stopwatch;
    PM_TRY_STATUS(merge_frame(merge, settings.command));
    FrameRecord record;
    record.frame = merge.frame;
    record.state = FrameRecord::State::kDone;
    record.stage = "samples " + describe_samples(merge);
    record.seconds = frame_stopwatch.seconds();
    record.files = {merge.output};
    parts += merge.parts.size();
    progress(++done, merges.size(), record);
  }
  if (options.json.enabled) PM_TRY_STATUS(write_json(options.json, to_json(merges)));
  log_info("{} merged from {} in {}", plural(done, "frame"), plural(parts, "part"),
           format_seconds(stopwatch.seconds()));
  return 0;
}

}  // namespace

void add_merge(CommandLine& line) {
  auto options = std::make_shared<MergeOptions>();
  Command command = add_command(
      line, "merge", "Merge frames that were rendered in ranges of samples.",
      "  polymorph render scene.json -o 'a/frame.####.exr' --samples 0-31/64\n"
      "  polymorph render scene.json -o 'b/frame.####.exr' --samples 32-63/64\n"
      "  polymorph merge a b -o 'out/frame.####.exr'",
      "  0 all frames are merged   2 usage\n"
      "  3 samples are missing, given twice, or of different pictures   4 cannot write\n"
      "  75, 130, 143 stopped by a signal: merged frames are whole");
  command
      .add_option("parts", options->settings.inputs, "PART|DIR...",
                  "EXR files that render --samples FIRST-LAST/TOTAL wrote, patterns of such files, "
                  "and folders with them, in any order")
      .required();
  command
      .add_option("-o,--output", options->settings.output, "FILE",
                  "frame.####.exr; # is a digit of the frame number")
      .required();
  command.add_flag(
      "--partial", options->settings.partial,
      "write a larger part where samples before the first or after the last are missing");
  command
      .add_flag("--draft", options->settings.draft,
                "write pictures of the samples that there are, to look at before the others are "
                "rendered")
      .excludes(command.option("--partial"));
  add_overwrite(command, line.common);
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_merge(line, *options); });
}

}  // namespace polymorph
