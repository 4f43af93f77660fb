#include <chrono>
#include <thread>

#include "base/file.h"
#include "base/frames.h"
#include "base/input_files.h"
#include "base/log.h"
#include "base/plural.h"
#include "base/text.h"
#include "cli/command_line.h"
#include "cli/progress.h"
#include "cli/scene_options.h"
#include "farm/receipt.h"
#include "film/frame_files.h"
#include "film/render_sequence.h"
#include "morph/timeline.h"
#include "render/sample_range.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

struct RenderOptions {
  std::string scene, output, frames, shard, samples, receipt;
  bool png = false, strict = false, skip_existing = false, keep_going = false, dry_run = false,
       stats = false, turntable = false, watch = false;
  int jobs = 0;           ///< frames rendered in parallel; 0: chosen by render_sequence()
  double heartbeat = 60;  ///< seconds
  SceneOptions scene_options;
  JsonOutput json;
};

/// Sets the scene's number of samples to that of --samples, which is a number or FIRST-LAST/TOTAL.
/// Returns the range, or nullopt for a number or an empty text. Errors: kUsage.
Result<std::optional<SampleRange>> apply_samples(Scene& scene, const std::string& text) {
  if (text.empty()) return std::optional<SampleRange>{};
  const auto number = parse_integer(text);
  if (number && (*number < 1 || *number > kMaxSamples))
    return make_error(ErrorCode::kUsage,
                      "--samples {}: write a number from 1 to {}, or FIRST-LAST/TOTAL", text,
                      kMaxSamples);
  PM_TRY(const SampleRange range,
         parse_sample_range(number ? fmt::format("0-{}/{}", *number - 1, *number) : text));
  scene.image.samples = range.total;
  return number ? std::nullopt : std::optional(range);
}

/// Converts the options to settings of the run. `sample_range`: the result of apply_samples().
Result<SequenceSettings> sequence_settings(const CommandLine& line, const RenderOptions& options,
                                           const Scene& scene,
                                           const std::optional<SampleRange>& sample_range) {
  SequenceSettings settings;
  const int count = frame_count(scene);
  PM_TRY(settings.frames, parse_frames_or_all(options.frames, 1, count));
  const bool is_sequence = settings.frames.size() > 1 || !options.shard.empty();
  if (!options.shard.empty()) {
    PM_TRY(const Shard shard, parse_shard(options.shard));
    log_info("shard {} of {}", shard.index, shard.count);
    settings.frames = take_shard(settings.frames, shard);
  }
  PM_TRY(const FrameFiles files, frame_files(scene, options.output, options.png, is_sequence));
  // A range of samples is rendered as a part of each picture, which some settings forbid.
  if (sample_range) PM_TRY_STATUS(check_part(scene, files));
  settings.part = sample_range;
  settings.exr = files.exr;
  settings.png = files.png;
  settings.view = options.scene_options.view;
  settings.existing = line.common.overwrite   ? Existing::kOverwrite
                      : options.skip_existing ? Existing::kSkip
                                              : Existing::kRefuse;
  settings.keep_going = options.keep_going;
  settings.strict = options.strict;
  settings.dry_run = options.dry_run;
  settings.jobs = options.jobs;
  settings.device = line.common.device;
  settings.max_memory = line.common.max_memory;
  settings.cache_folder = cache_folder(line.common);
  settings.command = line.arguments;
  settings.stop = &stop_requested();
  return settings;
}

/// Prints the result of a dry run: the frames on standard output, their cost on standard error.
void print_plan(const RunReport& report, const SequenceSettings& settings) {
  for (const FrameRecord& record : report.frames) {
    std::string files;
    for (const auto& file : record.files) files += fmt::format(" {}", file.string());
    print_data("frame {} {}{}{}\n", record.frame, record.stage, files,
               record.state == FrameRecord::State::kSkipped ? " (kept)" : "");
  }
  const auto planned = report.count(FrameRecord::State::kPlanned);
  const auto frames = static_cast<double>(planned);
  const auto skipped = report.count(FrameRecord::State::kSkipped);
  const FrameEstimate estimate = report.estimate.value_or(FrameEstimate{});
  // The pattern of a format that is not written is empty.
  const double frame_bytes = (settings.exr.empty() ? 0 : estimate.exr_bytes) +
                             (settings.png.empty() ? 0 : estimate.png_bytes);
  const double prepare_seconds = report.prepare_seconds + estimate.fit_seconds;
  log_info(
      "{} to render{}: about {} on {} ({} a frame, {} to prepare), {} on disk, {} "
      "of memory",
      plural(planned, "frame"), skipped ? fmt::format(", {} kept", skipped) : "",
      format_seconds(prepare_seconds + frames * estimate.seconds), plural(report.threads, "thread"),
      format_seconds(estimate.seconds), format_seconds(prepare_seconds),
      format_bytes(frames * frame_bytes), format_bytes(static_cast<double>(estimate.memory)));
  if (!estimate.unfitted.empty())
    log_info(
        "this is an estimate: the balls of {} are not in the cache, and fitting them takes about "
        "{}, once",
        fmt::join(estimate.unfitted, ", "), format_seconds(estimate.fit_seconds));
  // Compare with the space on the disk of the first frame.
  std::error_code error;
  const std::filesystem::path folder =
      std::filesystem::absolute(report.frames.front().files.front()).parent_path();
  const auto space = std::filesystem::space(folder, error);
  if (!error && frames * frame_bytes > static_cast<double>(space.available))
    log_warning("{}: has only {} left", folder.string(),
                format_bytes(static_cast<double>(space.available)));
}

/// Prints the seconds that each stage took, summed over the frames.
void print_stats(const RunReport& report) {
  double surface = 0, trace = 0, write = 0;
  for (const FrameRecord& record : report.frames) {
    surface += record.surface_seconds;
    trace += record.trace_seconds;
    write += record.write_seconds;
  }
  log_answer(
      fmt::format("device {}, embree {}, {} threads", report.device, report.isa, report.threads));
  const double slowest = std::max({surface, trace, write});
  log_answer(fmt::format(
      "prepare  {:>8.2f} s\nsurface  {:>8.2f} s\ntrace    {:>8.2f} s\nwrite    {:>8.2f} s\n"
      "frames   {:>8.2f} s, {:.0f} % of the slowest stage's: stages overlap\n"
      "total    {:>8.2f} s, peak memory {}",
      report.prepare_seconds, surface, trace, write, report.frames_seconds,
      slowest > 0 ? 100 * report.frames_seconds / slowest : 100.0, report.total_seconds,
      format_bytes(static_cast<double>(report.peak_memory))));
}

constexpr int kTurntableFrames = 72;  // 5 degrees per frame

/// Loads the scene with a camera that goes round once (--turntable). The camera circles a model, or
/// the still frame that -f names, or the scene while the film runs. `frames`: the text of -f, which
/// is cleared if it names a still frame, so that all frames of the turntable are rendered.
Result<Scene> load_turntable(const RenderOptions& options, std::span<const Override> overrides,
                             std::string& frames) {
  if (std::filesystem::path(options.scene).extension() != ".json" && !is_numbered(options.scene))
    return turntable_of_model(options.scene, overrides);
  PM_TRY(Scene scene, load_scene(options.scene, overrides));
  if (const auto frame = parse_integer(options.frames)) {
    const int count = film_frame_count(scene);
    PM_TRY(const std::vector<int> still, parse_frames(options.frames, 1, count));
    scene.frames.still = still.front();
    if (scene.frames.turntable == 0) scene.frames.turntable = kTurntableFrames;
    frames.clear();
  } else if (scene.camera.orbit == 0 && scene.frames.turntable == 0) {
    scene.camera.orbit = 360;
  }
  return scene;
}

/// Loads the scene, renders its frames, and writes the requested reports. Returns the exit code.
Result<int> render_once(const CommandLine& line, const RenderOptions& command_options) {
  RenderOptions options = command_options;  // load_turntable() may clear options.frames
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.scene_options.sets));
  PM_TRY(Scene scene, options.turntable ? load_turntable(options, overrides, options.frames)
                                        : load_scene(options.scene, overrides));
  apply_scene_options(scene, options.scene_options);
  PM_TRY(const std::optional<SampleRange> sample_range, apply_samples(scene, options.samples));
  PM_TRY(const SequenceSettings settings, sequence_settings(line, options, scene, sample_range));
  if (settings.frames.empty()) {
    log_info("no frames in this shard");
    if (options.json.enabled) PM_TRY_STATUS(write_json(options.json, to_json(RunReport{})));
    return 0;
  }
  const ProgressMode mode = options.dry_run ? ProgressMode::kNone : progress_mode(line.common);
  Heartbeat heartbeat(mode, options.heartbeat, settings.frames.size());
  const ProgressCallback show = make_progress(mode);
  PM_TRY(const RunReport report,
         render_sequence(scene, settings,
                         [&](std::size_t done, std::size_t count, const FrameRecord& last) {
                           heartbeat.restart(done);
                           show(done, count, last);
                         }));
  if (options.json.enabled) PM_TRY_STATUS(write_json(options.json, to_json(report)));
  if (options.dry_run) {
    if (!options.json.enabled) print_plan(report, settings);
    return 0;
  }
  if (!options.receipt.empty()) {
    PM_TRY(const std::string receipt, make_receipt(report));
    PM_TRY_STATUS(write_file(options.receipt, receipt));
  }
  if (options.stats) print_stats(report);
  const std::size_t failed = report.count(FrameRecord::State::kFailed);
  const auto done = report.count(FrameRecord::State::kDone),
             kept = report.count(FrameRecord::State::kSkipped);
  log_info("{} rendered{}{} in {}", plural(done, "frame"),
           kept ? fmt::format(", {} kept", kept) : "",
           failed ? fmt::format(", {} failed", failed) : "", format_seconds(report.total_seconds));
  if (report.stopped) {
    log_warning("stopped; finished frames are whole - run again with --skip-existing to resume");
    return static_cast<int>(stop_code());
  }
  return failed > 0 ? static_cast<int>(ErrorCode::kPartial) : 0;
}

/// Modification time and size of each file that the run reads.
using Snapshot = std::vector<std::pair<std::filesystem::file_time_type, std::uintmax_t>>;
/// Reads the modification times and sizes of `files`.
Snapshot take_snapshot(const std::vector<std::filesystem::path>& files) {
  Snapshot snapshot;
  for (const auto& file : files) {
    std::error_code missing;  // an editor may have removed the file for a moment
    const auto time = std::filesystem::last_write_time(file, missing);
    snapshot.emplace_back(time, std::filesystem::file_size(file, missing));
  }
  return snapshot;
}

/// Renders again whenever the scene or a file that it reads changes, until a signal comes. Prints
/// errors in the scene or its files and waits for the next change.
Result<int> watch_and_render(CommandLine& line, const RenderOptions& options) {
  using namespace std::chrono_literals;
  const std::atomic<bool>& stop = stop_requested();
  while (true) {
    const auto started = std::filesystem::file_time_type::clock::now();
    const auto exit_code = render_once(line, options);
    if (!exit_code && exit_code.error().code != ErrorCode::kInput) return exit_code.error();
    if (!exit_code) print_error(exit_code.error());
    line.common.overwrite = true;   // the frames are this run's own from now on
    remember_input(options.scene);  // to watch it even if it could not be read
    const auto files = input_files();
    const Snapshot before = take_snapshot(files);
    // A file that was written during the run may have been read in part: render again.
    bool changed = std::any_of(before.begin(), before.end(),
                               [&](const auto& file) { return file.first >= started; });
    if (!changed && !stop) log_info("watching {}", plural(files.size(), "file"));
    for (; !changed && !stop; changed = take_snapshot(files) != before)
      std::this_thread::sleep_for(50ms);
    if (stop) return 0;
    // Several files may be written, or one in pieces: wait until nothing changes for 50 ms.
    for (Snapshot last; !stop;) {
      Snapshot now = take_snapshot(files);
      if (now == last) break;
      last = std::move(now);
      std::this_thread::sleep_for(50ms);
    }
  }
}

Result<int> run_render(CommandLine& line, const RenderOptions& options) {
  return options.watch ? watch_and_render(line, options) : render_once(line, options);
}

}  // namespace

void add_render(CommandLine& line) {
  auto options = std::make_shared<RenderOptions>();
  Command command =
      add_command(line, "render", "Render a scene's frames to EXR and PNG.",
                  "  polymorph render scene.json -o 'out/frame.####.exr' --png\n"
                  "  polymorph render 'seq.####.obj' -o 'out/frame.####.png'\n"
                  "  polymorph render scene.json -o look.png -f 12 --preview\n"
                  "  polymorph render scene.json -o 'out/f.####.exr' --shard 2/8 --skip-existing",
                  "  0 all frames exist and are good   2 usage   3 bad scene, model or texture\n"
                  "  4 cannot write   5 device or memory   6 some frames failed (--keep-going)\n"
                  "  75 stopped early by SIGUSR1, 130, 143 stopped by another signal: finished\n"
                  "  frames are whole, run again with --skip-existing to go on");
  command
      .add_option("scene", options->scene, "SCENE",
                  "the scene file, or a mesh sequence as seq.####.obj (also .ply, .stl, .off, "
                  ".glb); with --turntable a model file, too")
      .required();
  command.add_option("-o,--output", options->output, "FILE",
                     "frame.####.exr or .png; # is a digit of the frame number");
  command.add_option("-f,--frames", options->frames, "LIST",
                     "1-48, 1-48x2, 5-1, 1,5,10-20; default: all");
  command.add_flag("--png", options->png, "a PNG beside each EXR");
  const Option overwrite = add_overwrite(command, line.common);
  command
      .add_flag("--skip-existing", options->skip_existing,
                "keep frames whose header says that they are current")
      .excludes(overwrite);
  command.add_flag("--watch", options->watch,
                   "render again whenever the scene or a file that it reads changes, until Ctrl-C");
  command.add_flag("--turntable", options->turntable,
                   "the camera goes once round: round a model (72 frames, of which -f takes "
                   "some), round the one frame that -f names, or while the film runs");
  command.add_flag("--strict", options->strict, "warnings about models and textures are errors");
  add_scene_options(command, options->scene_options);
  command
      .add_option("--samples", options->samples, "FIRST-LAST/TOTAL",
                  "render these samples of each pixel alone, 0-15/64 of 64, to be merged later "
                  "(merge); a number is that of --spp")
      .excludes(command.option("--spp"))
      .group("Farm");
  command
      .add_option("--shard", options->shard, "i/N",
                  "this share of the frames: 2/8, or auto from Slurm or MPI")
      .group("Farm");
  command
      .add_option("-j,--jobs", options->jobs, "N",
                  "frames rendered in parallel; default: by their size, and up to four on each GPU")
      .range(1, 256)
      .group("Farm");
  command.add_flag("--keep-going", options->keep_going, "go on after a failed frame; exit code 6")
      .group("Farm");
  command
      .add_flag("-n,--dry-run", options->dry_run,
                "say what would be rendered and what it costs; fit and write nothing")
      .group("Farm");
  command
      .add_option("--heartbeat", options->heartbeat, "S",
                  "seconds between lines of the log while no frame is finished (60); 0: none")
      .environment("POLYMORPH_HEARTBEAT")
      .range(0.0, 86400.0)
      .group("Farm");
  command
      .add_option("--receipt", options->receipt, "FILE",
                  "write an in-toto statement: the SHA-256 of the frames and of all that they were "
                  "made from")
      .group("Output");
  command.add_flag("--stats", options->stats, "say where the time went").group("Output");
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_render(line, *options); });
}

}  // namespace polymorph
