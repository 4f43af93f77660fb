#include "film/render_sequence.h"

#include <algorithm>
#include <deque>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/plural.h"
#include "base/stopwatch.h"
#include "base/worker.h"
#include "device/device.h"
#include "film/estimate.h"
#include "film/frame_files.h"
#include "film/part_files.h"
#include "film/status.h"
#include "image/image_io.h"
#include "kernels/interruption.h"
#include "mesh/mesh_check.h"
#include "morph/timeline.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/frame/render_frame.h"
#include "sequence/prepare/actor_poses.h"
#include "sequence/prepare/film_settings.h"
#include "sequence/prepare/prepare.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Reads the process's peak memory (VmHWM). getrusage() would include the parent's peak at the time
/// of the fork.
std::uint64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  std::uint64_t kilobytes = 0;
  for (std::string word; status >> word;)
    if (word == "VmHWM:") status >> kilobytes;
  return kilobytes * 1024;
}

std::vector<fs::path> list_files(const SequenceSettings& settings, int frame) {
  std::vector<fs::path> files;
  for (const FramePattern* pattern : {&settings.exr, &settings.png})
    if (!pattern->empty()) files.push_back(frame_path(*pattern, frame));
  return files;
}

/// Checks before any work that no file is a folder, that no file exists unless the settings permit
/// it, and that the folder of the files is writable. Removes old temporary files from that folder.
Status check_outputs(const SequenceSettings& settings) {
  std::size_t existing = 0;
  fs::path first_existing;
  for (const int frame : settings.frames) {
    for (const fs::path& file : list_files(settings, frame)) {
      std::error_code error;
      if (fs::is_directory(file, error) && !settings.keep_going) return check_writable(file);
      if (!fs::exists(file, error)) continue;
      if (existing++ == 0) first_existing = file;
    }
  }
  if (existing > 0 && settings.existing == Existing::kRefuse && !settings.dry_run)
    return make_error(ErrorCode::kOutput,
                      "{}: exists{} - add --overwrite to replace, or --skip-existing to resume",
                      first_existing.string(),
                      existing > 1 ? fmt::format(", and {} more", existing - 1) : "");
  // Patterns have no number in a folder's name, so all frames have the folder of the first one.
  for (const fs::path& file : list_files(settings, settings.frames.front())) {
    PM_TRY_STATUS(check_writable(file));
    const fs::path folder = file.parent_path();
    if (!settings.dry_run) remove_old_temporaries(folder.empty() ? fs::path(".") : folder);
  }
  return Ok{};
}

/// Writes a PNG, transformed by the view if there is one.
Status write_png(const Image& image, const std::filesystem::path& file, PngSettings png,
                 const SequenceSettings& settings, const std::optional<ViewTransform>& view) {
  if (!view) return write_image(file, image, png);
  Image shown = image;
  PM_TRY_STATUS(view->apply(shown, png.exposure));
  png.exposure = 0;  // the view has applied it
  shown.attributes.push_back({kViewAttribute, view_text(settings.view)});
  return write_image(file, shown, png);
}

Status write_frame(const Image& image, const SequenceSettings& settings, const Scene& scene,
                   int frame, const std::optional<ViewTransform>& view) {
  const PngSettings png = png_settings(scene, frame);
  const ExrSettings exr = settings.part ? ExrSettings{} : exr_settings(scene);
  if (!settings.exr.empty())
    PM_TRY_STATUS(write_image(frame_path(settings.exr, frame), image, png, exr));
  if (!settings.png.empty())
    PM_TRY_STATUS(write_png(image, frame_path(settings.png, frame), png, settings, view));
  return Ok{};
}

/// Checks that the files of mesh sequences that the frames show have no problem. Errors (kInput):
/// the message lists up to 20 problems.
Status check_meshes(const PreparedScene& prepared, const std::vector<int>& frames) {
  constexpr std::size_t kMaxNamedProblems = 20;
  std::vector<std::string> problems;
  const auto add_problem = [&](const MeshSequence* sequence, int mesh) {
    if (!sequence || mesh < 0) return;
    const std::string& problem = sequence->files[static_cast<std::size_t>(mesh)].problem;
    if (!problem.empty() && std::find(problems.begin(), problems.end(), problem) == problems.end())
      problems.push_back(problem);
  };
  for (const int frame : frames)
    for (const PreparedActor& actor : prepared.actors) {
      const MorphState state = morph_state_at(actor.timeline, shown_frame(prepared.scene, frame));
      add_problem(actor.sequence.get(), state.mesh);
      if (!actor.poses) continue;
      if (shows_source(state)) add_problem(moving_sequence(actor, state.leg), state.mesh);
      if (shows_target(state)) add_problem(moving_sequence(actor, state.leg + 1), state.to_mesh);
    }
  if (problems.empty()) return Ok{};
  const std::size_t count = problems.size();
  if (count > kMaxNamedProblems) problems.resize(kMaxNamedProblems);
  return make_error(
      ErrorCode::kInput, "{}{}\n--keep-going renders the other frames", fmt::join(problems, "\n"),
      count > kMaxNamedProblems ? fmt::format("\n... and {} more", count - kMaxNamedProblems) : "");
}

/// A run of render_sequence(). Tracers and writers are threads, so that several frames are in
/// progress: each frame is started (start_frame()), traced (begin_tracing(), finish_tracing()) and
/// written (begin_writing(), finish_writing()). Frames finish in the order of settings.frames.
class SequenceRun {
 public:
  SequenceRun(const SequenceSettings& settings, const ProgressCallback& progress)
      : settings_(settings), progress_(progress) {}

  Result<RunReport> run(const Scene& scene) {
    // Check outputs, devices and memory before any work.
    const Stopwatch stopwatch;
    report_.threads = thread_count();
    PM_TRY_STATUS(check_outputs(settings_));
    PM_TRY(const std::vector<std::string> devices, list_devices(settings_.device));
    PM_TRY(engine_, make_engine(settings_.device, report_.device, settings_.max_memory));
    choose_jobs(scene.image, static_cast<int>(devices.size()));
    const std::size_t picture_count = pictures_at_once();
    PM_TRY_STATUS(
        check_picture_memory(scene.image, picture_count, settings_.max_memory, settings_.part));
    if (scene.image.denoise) PM_TRY_STATUS(check_denoiser());
    if (!settings_.png.empty() && !settings_.view.empty()) {
      PM_TRY(view_, ViewTransform::open(settings_.view));
    }
    // Prepare the scene while the tracers open.
    begin_opening(devices);
    PM_TRY(prepared_, prepare_scene(scene, *engine_,
                                    {settings_.cache_folder,
                                     {settings_.max_memory, picture_count},
                                     settings_.dry_run ? Fits::kCached : Fits::kMake}));
    for (const std::string& warning : prepared_.warnings) log_warning("{}", warning);
    if (settings_.strict && !prepared_.warnings.empty())
      return make_error(ErrorCode::kInput,
                        "{}: {} about its files - fix them, or render without --strict",
                        scene.path.string(), plural(prepared_.warnings.size(), "warning"));
    if (!settings_.keep_going) PM_TRY_STATUS(check_meshes(prepared_, settings_.frames));
    // Check again: only now are all input files known, which no output may overwrite.
    if (!settings_.keep_going)
      for (const int frame : settings_.frames)
        for (const fs::path& file : list_files(settings_, frame))
          PM_TRY_STATUS(check_writable(file));
    report_.prepare_seconds = stopwatch.seconds();
    PM_TRY_STATUS(finish_opening(devices));
    report_.isa = tracers_.front()->renderer->isa();
    report_.scene_hash = prepared_.hashes.scene;
    report_.provenance = make_provenance(scene, prepared_.inputs);
    if (settings_.exr.empty()) prepared_.scene.image.aovs = "none";  // PNG has no layers
    // Render the frames.
    report_.frames.resize(settings_.frames.size());
    const Stopwatch frames_stopwatch;
    Status status = Ok{};
    try {
      status = start_frames();
      // Finish frames in progress even after a failure or a stop: no file may be incomplete.
      Status finished = finish_all();
      if (status) status = std::move(finished);
    } catch (const Interrupted&) {
      abandon_frames();
    }
    if (!status && !settings_.keep_going) return std::move(status).error();
    std::erase_if(report_.frames, [](const FrameRecord& record) { return record.frame == 0; });
    // After a dry run, estimate the cost of the frames that are not current.
    if (settings_.dry_run) {
      std::vector<int> planned;
      for (const FrameRecord& record : report_.frames)
        if (record.state == FrameRecord::State::kPlanned) planned.push_back(record.frame);
      PM_TRY(Renderer renderer, make_renderer(tracers_.front()->device, settings_.max_memory));
      PM_TRY(report_.estimate,
             estimate_frames(prepared_, *engine_, renderer, planned, settings_.part));
    }
    report_.frames_seconds = frames_stopwatch.seconds();
    report_.peak_memory = peak_memory_bytes();
    report_.total_seconds = stopwatch.seconds();
    return std::move(report_);
  }

 private:
  /// A thread that makes surfaces and traces frames.
  struct Tracer {
    explicit Tracer(int max_threads) : worker(max_threads) {}
    std::optional<Renderer> renderer;  ///< set once the tracer is open
    std::string device;                ///< device that traces, "cpu" or "cuda:N"
    std::unique_ptr<Engine> engine;  ///< engine of its GPU; null: start_frame() makes the surfaces
    std::future<Status> opened;      ///< result of opening the tracer
    Worker worker;                   // destroyed first: its tasks use the members above
  };
  /// The surfaces of a frame and their measures for the report.
  struct Surfaces {
    FrameGeometry geometry;
    std::size_t balls = 0, vertices = 0, triangles = 0;
    std::string digest;
    double seconds = 0;  ///< time of making the surfaces
  };
  /// Result of tracing a frame.
  struct Traced {
    Result<Image> image;
    double seconds = 0;  ///< time of tracing
    Surfaces surfaces;   ///< without the geometry
  };
  /// A frame that is being traced.
  struct Tracing {
    /// Indices (in settings_.frames) of the frame and of the next frames with identical pixels.
    std::vector<std::size_t> indices;
    std::string key;                            ///< picture_key()
    std::future<std::optional<Traced>> result;  ///< empty if the run was stopped before it began
  };
  /// Result of writing a frame.
  struct Written {
    Status status;
    double seconds = 0;
  };

  /// Sets jobs_ to the number in the settings or, if that is 0, to as many as suit the device and
  /// the memory limit. Every GPU gets at least one job. Sets frames_ahead_.
  void choose_jobs(const ImageSettings& image, int devices) {
    jobs_ = settings_.jobs;
    if (jobs_ == 0) {
      jobs_ = cpu_jobs(image.width, image.height, settings_.frames.size());
      if (report_.device != "cpu") jobs_ = std::max(jobs_, gpu_jobs(devices));
      while (jobs_ > 1 &&
             !check_picture_memory(image, pictures_at_once(), settings_.max_memory, settings_.part))
        --jobs_;
    }
    jobs_ = std::max(jobs_, devices);
    jobs_ = std::min(jobs_, std::max(1, static_cast<int>(settings_.frames.size())));
    // Frames finish in order, so a GPU that is done early needs a second frame to work on while
    // slower GPUs finish theirs.
    if (report_.device != "cpu") frames_ahead_ = (jobs_ + 1) / 2;
    while (frames_ahead_ > 0 &&
           !check_picture_memory(image, pictures_at_once(), settings_.max_memory, settings_.part))
      --frames_ahead_;
  }

  /// Returns the maximum number of frames that are given to tracers at once.
  std::size_t frames_at_once() const { return static_cast<std::size_t>(jobs_ + frames_ahead_); }

  /// Returns the maximum number of pictures that are traced or written at once.
  std::size_t pictures_at_once() const {
    return std::min(settings_.frames.size(), frames_at_once() + static_cast<std::size_t>(jobs_));
  }

  /// Returns the maximum number of threads for the parallel loops of a tracer or a writer. Beside
  /// GPUs the loops are short, and to wake many threads for each takes longer than the loop: with
  /// 16 jobs on 64 threads, 8 threads a loop give 1.08 times as many frames a second as 64. Half of
  /// the jobs wait for GPUs.
  int loop_threads() const {
    if (report_.device == "cpu" || jobs_ == 1) return tbb::task_arena::automatic;
    return std::max(2, 2 * thread_count() / jobs_);
  }

  /// Starts to open the tracers in their threads, so that they open while the scene is prepared: a
  /// GPU takes some tenths of a second to be ready, and several GPUs get ready one after another.
  void begin_opening(const std::vector<std::string>& devices) {
    for (int i = 0; i < jobs_; ++i) {
      tracers_.push_back(std::make_unique<Tracer>(loop_threads()));
      writers_.push_back(std::make_unique<Worker>(loop_threads()));
      Tracer& tracer = *tracers_.back();
      const std::string device =
          report_.device == "cpu" ? "cpu" : devices[static_cast<std::size_t>(i) % devices.size()];
      tracer.opened = tracer.worker.run([this, &tracer, device]() -> Status {
        tracer.device = device;
        if (device != "cpu") {
          PM_TRY(tracer.engine, make_engine(device, tracer.device, settings_.max_memory));
        }
        PM_TRY(tracer.renderer, make_renderer(tracer.device, settings_.max_memory));
        return Ok{};
      });
    }
  }

  /// Waits until all tracers are open. Errors: those of make_engine() and make_renderer().
  Status finish_opening(const std::vector<std::string>& devices) {
    for (const auto& tracer : tracers_) PM_TRY_STATUS(tracer->opened.get());
    if (devices.size() > 1) {
      const std::size_t used = std::min(devices.size(), tracers_.size());
      report_.device = fmt::format("{}", fmt::join(std::span(devices).first(used), ","));
    }
    return Ok{};
  }

  /// Starts all frames, until the caller stops the run. Errors: the first one, unless keep_going.
  Status start_frames() {
    for (std::size_t i = 0; i < settings_.frames.size(); ++i) {
      if (settings_.stop && *settings_.stop) {
        report_.stopped = true;
        break;
      }
      auto status = start_frame(i);
      if (!status && !settings_.keep_going) return status;
    }
    return Ok{};
  }

  /// Starts a frame while earlier ones are traced, encoded and written. Makes the frame's surfaces
  /// first, unless the tracers have engines of their own. A frame that is skipped or has failed is
  /// recorded only after finish_all(), so that frames finish in order.
  Status start_frame(std::size_t index) {
    FrameRecord& record = report_.frames[index];
    record.frame = settings_.frames[index];
    record.files = list_files(settings_, record.frame);
    record.stage = stage_names(prepared_, record.frame);
    if (settings_.existing == Existing::kSkip && is_current(record)) {
      record.state = FrameRecord::State::kSkipped;
      PM_TRY_STATUS(finish_all());
      return record_finish(record);
    }
    if (settings_.existing == Existing::kSkip)
      if (const Status check = check_no_samples_lost(record); !check) {
        PM_TRY_STATUS(finish_all());
        return record_failure(record, check.error());
      }
    if (settings_.dry_run) return record_finish(record);
    // A frame with the pixels of the frame before is not traced again.
    std::string key = picture_key(prepared_, record.frame);
    if (!key.empty() && !tracing_.empty() && tracing_.back().key == key) {
      tracing_.back().indices.push_back(index);
      return Ok{};
    }
    // Make the surfaces, and give them to a tracer as soon as it may take another frame.
    std::optional<Surfaces> surfaces;
    if (!tracers_.front()->engine) {
      auto result = make_surfaces(record.frame, *engine_);
      if (!result) {
        PM_TRY_STATUS(finish_all());
        return record_failure(record, result.error());
      }
      surfaces = std::move(*result);
    }
    Status status = Ok{};
    if (tracing_.size() == frames_at_once()) status = finish_tracing();
    begin_tracing(index, std::move(key), std::move(surfaces));
    return status;
  }

  /// Makes the surfaces of a frame and measures them.
  Result<Surfaces> make_surfaces(int frame, Engine& engine) const {
    const Stopwatch stopwatch;
    Surfaces surfaces;
    PM_TRY(surfaces.geometry, geometry_at(prepared_, engine, frame));
    const Mesh mesh = join_surfaces(surfaces.geometry);
    surfaces.balls = ball_count(surfaces.geometry);
    surfaces.vertices = mesh.positions.size();
    surfaces.triangles = mesh.triangles.size();
    if (surfaces.triangles > 0) surfaces.digest = mesh_digest(mesh);
    surfaces.seconds = stopwatch.seconds();
    return surfaces;
  }

  /// Traces a frame on the next tracer, which also makes its surfaces unless they are given.
  void begin_tracing(std::size_t index, std::string key, std::optional<Surfaces> surfaces) {
    Tracer* tracer = tracers_[started_count_++ % tracers_.size()].get();
    const int frame = report_.frames[index].frame;
    auto task = [this, tracer, frame,
                 surfaces = std::move(surfaces)]() mutable -> std::optional<Traced> {
      if (settings_.stop && *settings_.stop) return std::nullopt;
      if (!surfaces) {
        auto result = make_surfaces(frame, *tracer->engine);
        if (!result) return Traced{result.error(), /*seconds=*/0, /*surfaces=*/{}};
        surfaces = std::move(*result);
      }
      const Stopwatch stopwatch;
      auto image =
          render_samples(prepared_, {surfaces->geometry, settings_.part}, *tracer->renderer,
                         {report_.isa, tracer->device, settings_.command});
      surfaces->geometry = {};  // no longer needed: frees its memory
      return Traced{std::move(image), stopwatch.seconds(), std::move(*surfaces)};
    };
    tracing_.push_back({{index}, std::move(key), tracer->worker.run(std::move(task))});
  }

  /// Waits until the oldest frame is traced, and starts to write it and the frames with identical
  /// pixels. Returns the first error.
  Status finish_tracing() {
    Tracing tracing = std::move(tracing_.front());
    std::optional<Traced> result = tracing.result.get();
    tracing_.pop_front();
    if (!result) {
      report_.stopped = true;
      for (const std::size_t index : tracing.indices) report_.frames[index].frame = 0;  // dropped
      return Ok{};
    }
    Traced& traced = *result;
    if (!traced.image) {
      Status first_error = Ok{};
      for (const std::size_t index : tracing.indices) {
        Status status = record_failure(report_.frames[index], traced.image.error());
        if (first_error) first_error = std::move(status);
      }
      return first_error;
    }
    const auto image = std::make_shared<const Image>(std::move(*traced.image));
    Status first_error = Ok{};
    for (const std::size_t index : tracing.indices) {
      FrameRecord& record = report_.frames[index];
      record.balls = traced.surfaces.balls;
      record.vertices = traced.surfaces.vertices;
      record.triangles = traced.surfaces.triangles;
      record.digest = traced.surfaces.digest;
      const bool is_repeat = index != tracing.indices.front();
      if (!is_repeat) {
        record.surface_seconds = traced.surfaces.seconds;
        record.trace_seconds = traced.seconds;
        record.seconds = record.surface_seconds + traced.seconds;
      }
      Status status = begin_writing(index, image, is_repeat);
      if (first_error) first_error = std::move(status);
    }
    return first_error;
  }

  /// Starts to write a frame. If all writers are busy, first finishes the oldest write, and returns
  /// its status. `is_repeat`: the image was traced for another frame and needs a new header.
  Status begin_writing(std::size_t index, const std::shared_ptr<const Image>& image,
                       bool is_repeat) {
    Status oldest = Ok{};
    if (writing_.size() == static_cast<std::size_t>(jobs_)) oldest = finish_writing();
    const int frame = report_.frames[index].frame;
    auto task = [this, frame, image, is_repeat]() -> Written {
      const Stopwatch stopwatch;
      if (!is_repeat) {
        Status status = write_frame(*image, settings_, prepared_.scene, frame, view_);
        return {std::move(status), stopwatch.seconds()};
      }
      Image copy = *image;
      put_header(prepared_, frame, {report_.isa, report_.device, settings_.command}, copy);
      Status status = write_frame(copy, settings_, prepared_.scene, frame, view_);
      return {std::move(status), stopwatch.seconds()};
    };
    // Writers are used in turn and the oldest write is finished first, so the next writer is free.
    std::rotate(writers_.begin(), writers_.begin() + 1, writers_.end());
    writing_.emplace_back(index, writers_.back()->run(std::move(task)));
    return oldest;
  }

  /// Waits until the oldest write is done, and records its frame.
  Status finish_writing() {
    FrameRecord& record = report_.frames[writing_.front().first];
    const Written written = writing_.front().second.get();
    writing_.pop_front();
    record.write_seconds = written.seconds;
    if (!written.status) return record_failure(record, written.status.error());
    record.state = FrameRecord::State::kDone;
    return record_finish(record);
  }

  /// Finishes all frames in progress. Returns the first error, unless keep_going.
  Status finish_all() {
    Status first_error = Ok{};
    const auto note = [&](Status status) {
      if (first_error && !status) first_error = std::move(status);
    };
    while (!tracing_.empty()) note(finish_tracing());
    while (!writing_.empty()) note(finish_writing());
    return settings_.keep_going ? Status(Ok{}) : first_error;
  }

  /// After an Interrupted exception, waits until nothing is in progress and drops the frames that
  /// are not finished. A future whose get() has thrown the exception is no longer valid().
  void abandon_frames() {
    for (Tracing& tracing : tracing_)
      if (tracing.result.valid()) tracing.result.wait();
    tracing_.clear();
    for (; !writing_.empty(); writing_.pop_front()) {
      auto& [index, result] = writing_.front();
      if (!result.valid()) continue;
      try {
        if (result.get().status) report_.frames[index].state = FrameRecord::State::kDone;
      } catch (const Interrupted&) {
        // This write was interrupted, too: its frame stays kPlanned.
      }
    }
    report_.stopped = true;
    for (FrameRecord& record : report_.frames)
      if (record.state == FrameRecord::State::kPlanned) record.frame = 0;  // run() erases it
  }

  /// Tests whether all files of a frame are current.
  bool is_current(const FrameRecord& record) const {
    const ExpectedFrame expected{frame_hash(prepared_.scene, prepared_.hashes, record.frame),
                                 record.frame, prepared_.scene.output, settings_.view,
                                 settings_.part};
    for (const fs::path& file : record.files) {
      std::error_code error;
      if (!fs::exists(file, error)) return false;
      if (file_state(file, expected) == FileState::kCurrent) continue;
      if (!check_no_samples_lost(record)) return false;  // start_frame() reports this
      log_info("{}: is of another scene or settings - {}", file.string(),
               settings_.dry_run ? "it would be rendered again" : "rendering it again");
      return false;
    }
    return true;
  }

  /// Checks that no EXR of the frame would be replaced that has other samples of the same picture
  /// than this run renders. Errors: kOutput.
  Status check_no_samples_lost(const FrameRecord& record) const {
    const std::string hash = frame_hash(prepared_.scene, prepared_.hashes, record.frame);
    const auto describe = [](const std::optional<SampleRange>& part) {
      return part ? "samples " + format_sample_range(*part) : std::string("all samples");
    };
    for (const fs::path& file : record.files) {
      std::error_code error;
      if (file.extension() != ".exr" || !fs::exists(file, error)) continue;
      const auto header = read_frame_header(file);
      if (!header || header->identity != hash || header->frame != record.frame) continue;
      if (describe(header->part) == describe(settings_.part)) continue;
      return make_error(ErrorCode::kOutput,
                        "{}: has {} of this frame, which would be lost - write to another name, or "
                        "add --overwrite",
                        file.string(), describe(header->part));
    }
    return Ok{};
  }

  /// Records and reports a frame that has failed. Returns its error.
  Status record_failure(FrameRecord& record, const Error& error) {
    record.state = FrameRecord::State::kFailed;
    record.error = error.message;
    if (settings_.keep_going) log_message(LogLevel::kError, error.message);
    ++finished_;
    if (progress_) progress_(finished_, report_.frames.size(), record);
    return error;
  }

  /// Reports a frame that is written, skipped or, in a dry run, planned.
  Status record_finish(const FrameRecord& record) {
    ++finished_;
    if (progress_) progress_(finished_, report_.frames.size(), record);
    return Ok{};
  }

  const SequenceSettings& settings_;
  const ProgressCallback& progress_;
  std::unique_ptr<Engine> engine_;
  PreparedScene prepared_;
  std::optional<ViewTransform> view_;  ///< view of PNG files
  RunReport report_;
  std::size_t finished_ = 0;       ///< number of finished frames, for progress_
  int jobs_ = 1;                   ///< number of tracers and of writers
  int frames_ahead_ = 0;           ///< number of frames that are given to busy tracers
  std::size_t started_count_ = 0;  ///< number of frames given to tracers, which take turns
  std::deque<Tracing> tracing_;    ///< oldest first
  /// Frames that are being written, oldest first: index in settings_.frames, and the result.
  std::deque<std::pair<std::size_t, std::future<Written>>> writing_;
  // The tasks of tracers and writers use the members above, so these threads are destroyed first.
  std::vector<std::unique_ptr<Tracer>> tracers_;
  std::vector<std::unique_ptr<Worker>> writers_;
};

}  // namespace

int gpu_jobs(int devices) {
  // A GPU traces one frame while the CPU repairs the surfaces and finishes the pictures of others.
  constexpr int kMin = 2, kMax = 4;  // frames per GPU
  return std::clamp(thread_count() / devices, kMin, kMax) * devices;
}

int cpu_jobs(int width, int height, std::size_t frames) {
  constexpr int kTile = 16;  // pixels along a tile's edge (render/film/convergence.h)
  // Choose so many jobs that their frames have 64 tiles per thread, but at most one job per thread
  // and per frame.
  constexpr int kTilesPerThread = 64, kMaxJobs = 16;
  const int tiles = ((width + kTile - 1) / kTile) * ((height + kTile - 1) / kTile);
  const int jobs = (kTilesPerThread * thread_count() + tiles - 1) / tiles;
  return std::clamp(
      std::min(jobs, thread_count()), 1,
      std::clamp(static_cast<int>(std::min<std::size_t>(frames, kMaxJobs)), 1, kMaxJobs));
}

Status check_part(const Scene& scene, const FrameFiles& files) {
  const auto refuse = [](const char* reason) {
    return make_error(ErrorCode::kUsage, "--samples: {}", reason);
  };
  if (scene.image.noise > 0)
    return refuse(
        "adaptive sampling takes samples until the noise is low enough, so it has no ranges - "
        "render with --set image.noise=0");
  if (scene.image.denoise)
    return refuse(
        "denoising needs all samples at once - render with --set image.denoise=false, and denoise "
        "the merged picture");
  if (!files.png.empty())
    return refuse(
        "a part is an EXR file; a PNG cannot hold its sums - name an .exr file, without --png, and "
        "with --set output.png=false where the scene asks for PNG files");
  return Ok{};
}

Result<RunReport> render_sequence(const Scene& scene, const SequenceSettings& settings,
                                  const ProgressCallback& progress) {
  PM_CHECK(!settings.frames.empty());
  return SequenceRun(settings, progress).run(scene);
}

}  // namespace polymorph
