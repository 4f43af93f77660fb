#include <algorithm>
#include <system_error>

#include "base/frames.h"
#include "base/json.h"
#include "base/log.h"
#include "cli/command_line.h"
#include "cli/scene_options.h"
#include "film/frame_files.h"
#include "film/part_files.h"
#include "film/partial_frames.h"
#include "film/status.h"
#include "morph/timeline.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

struct StatusOptions {
  std::string where, scene, frames;  ///< `where`: pattern or folder of the frames
  bool png = false;
  SceneOptions scene_options;
  JsonOutput json;
};

/// The word for a state in the table and in the JSON report.
struct StateName {
  FileState state;
  const char* name;
};
/// All states, in the order of FileState, by which they are indexed.
constexpr StateName kStates[]{{FileState::kCurrent, "whole"},
                              {FileState::kMissing, "missing"},
                              {FileState::kStale, "stale"},
                              {FileState::kUnreadable, "unreadable"},
                              {FileState::kPart, "part"}};

JsonValue to_json(const std::vector<int>& frames, const std::vector<FileState>& states,
                  const std::string& hash, const std::vector<PartialFrames>& partial_groups) {
  JsonValue json{{"ok", true}, {"scene_hash", hash}};
  for (const StateName& state : kStates) json[state.name] = JsonValue::array();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    json[kStates[static_cast<std::size_t>(states[i])].name].push_back(frames[i]);
    if (states[i] != FileState::kCurrent) json["ok"] = false;
  }
  json["samples"] = JsonValue::array();
  for (const PartialFrames& group : partial_groups)
    json["samples"].push_back({{"samples", format_samples(group.ranges)},
                               {"total", group.total()},
                               {"frames", group.frames}});
  return json;
}

/// Returns the command that renders the frames with the given options.
std::string render_command(const CommandLine& line, const StatusOptions& options,
                           const std::string& output) {
  std::string command =
      fmt::format("{} render {} -o {}{}", line.program, quote_for_shell(options.scene),
                  quote_for_shell(output), options.png ? " --png" : "");
  for (const std::string& word : to_arguments(options.scene_options))
    command += " " + quote_for_shell(word);
  return command;
}

/// Describes the next step to complete frames that have parts with the same ranges of samples:
/// render the missing samples, or merge the parts.
std::string next_step(const CommandLine& line, const std::string& output,
                      const PartialFrames& group) {
  const std::string frames = format_frame_list(group.frames);
  if (!group.is_complete()) {
    std::string ranges;
    for (const SampleRange& range : missing_ranges(group.ranges, group.total()))
      ranges +=
          fmt::format("{}--samples {}", ranges.empty() ? "" : " and ", format_sample_range(range));
    return fmt::format("to complete the samples of {}: render them with {}", frames, ranges);
  }
  std::string command = fmt::format("{} merge", line.program);
  for (const fs::path& folder : group.folders) command += " " + quote_for_shell(folder.string());
  return fmt::format("to complete {}: {} -o {}", frames, command, quote_for_shell(output));
}

/// Prints which frames are in which state, and logs the commands that complete the sequence.
Result<int> run_status(const CommandLine& line, const StatusOptions& options) {
  PM_TRY(const Scene scene, load_scene_with(options.scene, options.scene_options));
  // Name the files. In a folder, which may not exist yet, frames have the names of output.file.
  std::error_code error;
  const bool is_folder =
      fs::is_directory(options.where, error) ||
      (!fs::exists(options.where, error) && !fs::path(options.where).has_extension());
  const std::string output =
      is_folder ? (fs::path(options.where) / fs::path(scene.output.file).filename()).string()
                : options.where;
  PM_TRY(const FrameFiles files, frame_files(scene, output, options.png, /*is_sequence=*/true));
  const int count = frame_count(scene);
  PM_TRY(std::vector<int> frames, parse_frames_or_all(options.frames, 1, count));
  std::sort(frames.begin(), frames.end());
  // Find the state of each frame, and the parts of those that are not whole.
  PM_TRY(ExpectedHashes hashes, expected_hashes(scene, frames));
  hashes.view = options.scene_options.view;
  const std::vector<FileState> states = frame_states(files, frames, hashes);
  const fs::path output_folder = fs::path(output).parent_path();
  const std::vector<PartialFrames> partial_groups =
      find_partial_frames(output_folder, frames, states, hashes);
  if (options.json.enabled)
    PM_TRY_STATUS(write_json(options.json, to_json(frames, states, hashes.scene, partial_groups)));
  // Print the frames of each state.
  std::vector<int> incomplete;
  for (const StateName& state : kStates) {
    std::vector<int> matching;
    for (std::size_t i = 0; i < frames.size(); ++i)
      if (states[i] == state.state) matching.push_back(frames[i]);
    if (state.state != FileState::kCurrent)
      incomplete.insert(incomplete.end(), matching.begin(), matching.end());
    if (!options.json.enabled && !(matching.empty() && state.state != FileState::kCurrent))
      print_data("{:<10} {:>6}  {}\n", state.name, matching.size(), format_frame_list(matching));
  }
  if (incomplete.empty()) return 0;
  // Log the next steps: first for frames with parts, then for those that must be rendered.
  for (const PartialFrames& group : partial_groups) {
    if (!options.json.enabled)
      print_data("{:<10} {:>6}  {}: {} of {}\n", "samples", group.frames.size(),
                 format_frame_list(group.frames), format_samples(group.ranges), group.total());
    std::erase_if(incomplete, [&](int frame) {
      return std::binary_search(group.frames.begin(), group.frames.end(), frame);
    });
    log_info("{}", next_step(line, output, group));
  }
  std::sort(incomplete.begin(), incomplete.end());
  if (!incomplete.empty())
    log_info("to complete it: {} -f {} --skip-existing", render_command(line, options, output),
             format_frame_list(incomplete));
  return static_cast<int>(ErrorCode::kAnswerNo);
}

}  // namespace

void add_status(CommandLine& line) {
  auto options = std::make_shared<StatusOptions>();
  Command command = add_command(
      line, "status", "Say which frames of a sequence are whole, missing or stale.",
      "  polymorph status out scene.json\n"
      "  polymorph status 'out/frame.####.exr' scene.json --set image.samples=64 --json",
      "  0 all frames are whole   1 some are not   2 usage   3 bad scene or model");
  command
      .add_option("frames", options->where, "DIR|FRAMES",
                  "pattern that render was given, or its folder where the "
                  "names are the scene's own (frame.####.exr)")
      .required();
  command.add_option("scene", options->scene, "SCENE", "the scene file").required();
  command.add_option("-f,--frames", options->frames, "LIST", "these frames alone; default: all");
  command.add_flag("--png", options->png, "a frame is whole only with its PNG");
  add_scene_options(command, options->scene_options);
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_status(line, *options); });
}

}  // namespace polymorph
