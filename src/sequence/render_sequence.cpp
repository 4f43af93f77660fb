#include "sequence/render_sequence.h"

#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <deque>
#include <future>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/program_identity.h"
#include "base/text.h"
#include "image/image_io.h"
#include "morph/timeline.h"
#include "scene/json_text.h"
#include "sequence/film.h"
#include "surface/mesh_check.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kHashAttribute = "polymorph/scene_hash";

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::uint64_t peak_memory_bytes() {
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux counts kB
}

std::vector<fs::path> files_of(const SequenceSettings& settings, int frame) {
  std::vector<fs::path> files;
  for (const FramePattern* pattern : {&settings.exr, &settings.png})
    if (!pattern->before.empty() || pattern->has_number())
      files.push_back(frame_path(*pattern, frame));
  return files;
}

bool has_exr(const SequenceSettings& settings) {
  return !settings.exr.before.empty() || settings.exr.has_number();
}
bool has_png(const SequenceSettings& settings) {
  return !settings.png.before.empty() || settings.png.has_number();
}

/// A file is this frame of this scene when its header says so; a name alone proves nothing.
bool is_current(const fs::path& file, const std::string& hash, int frame) {
  const auto image = read_image(file);
  if (!image) return false;
  // EXR keeps the frame as a number, PNG as text.
  const auto says = [&](const char* name, const std::string& wanted) {
    return std::any_of(image->attributes.begin(), image->attributes.end(), [&](const Attribute& a) {
      return a.name == name &&
             std::visit([](const auto& v) { return fmt::format("{}", v); }, a.value) == wanted;
    });
  };
  return says(kHashAttribute, hash) && says("polymorph/frame", fmt::format("{}", frame));
}

/// Before any work: every name must be free (or may be replaced) and every folder writable.
Status check_outputs(const SequenceSettings& settings) {
  std::size_t existing = 0;
  fs::path first;
  for (const int frame : settings.frames) {
    for (const fs::path& file : files_of(settings, frame)) {
      std::error_code error;
      if (fs::is_directory(file, error) && !settings.keep_going) return check_writable(file);
      if (!fs::exists(file, error)) continue;
      if (existing++ == 0) first = file;
    }
  }
  if (existing > 0 && settings.existing == Existing::kRefuse && !settings.dry_run)
    return make_error(ErrorCode::kOutput,
                      "{}: exists{} - add --overwrite to replace, or --skip-existing to resume",
                      first.string(),
                      existing > 1 ? fmt::format(", and {} more", existing - 1) : "");
  for (const fs::path& file : files_of(settings, settings.frames.front()))
    PM_TRY_STATUS(check_writable(file));
  return Ok{};
}

Status write_frame(const Image& image, const SequenceSettings& settings, const Scene& scene,
                   int frame) {
  PngSettings png;
  png.exposure = scene_at(scene, static_cast<double>(frame)).image.exposure;
  png.bits = scene.output.png_bits;
  png.dither = scene.output.dither;
  // Where nothing else crawls, the dither must not.
  png.seed = scene.image.seed + (scene.image.steady ? 0 : static_cast<std::uint64_t>(frame));
  if (has_exr(settings)) PM_TRY_STATUS(write_image(frame_path(settings.exr, frame), image));
  if (has_png(settings)) PM_TRY_STATUS(write_image(frame_path(settings.png, frame), image, png));
  return Ok{};
}

std::vector<Attribute> header_of(const PreparedScene& prepared, int frame, const std::string& isa,
                                 const std::string& device, const std::string& command) {
  std::vector<Attribute> attributes{
      {"Software", std::string("polymorph ") + PM_VERSION},
      {"FramesPerSecond", prepared.scene.frames.fps},
      {"polymorph/version", std::string(PM_VERSION)},
      {kHashAttribute, frame_hash(prepared, frame)},
      {"polymorph/frame", frame},
      {"polymorph/t", sequence_time(prepared.scene, shown_frame(prepared.scene, frame))},
      {"polymorph/stage", stage_names(prepared, frame)},
      {"polymorph/device", device},
      {"polymorph/isa", isa},
      {"polymorph/samples", prepared.scene.image.samples},
      {"polymorph/exposure", scene_at(prepared.scene, static_cast<double>(frame)).image.exposure},
      {"polymorph/seed", fmt::format("{}", prepared.scene.image.seed)}};
  if (aov_is_chosen(prepared.scene.image.aovs, "label")) {
    std::string names;
    int number = 0;
    for (const PreparedActor& actor : prepared.actors)
      for (const std::string& name : actor.label_names)
        names += fmt::format("{}{} {}{}", names.empty() ? "" : ", ", ++number,
                             prepared.actors.size() > 1 ? actor.name + "." : "", name);
    attributes.push_back({"polymorph/labels", names});
  }
  if (!command.empty()) attributes.push_back({"polymorph/command", printable(command)});
  return attributes;
}

/// The header before what says how to read the picture's mattes.
void put_header(Image& image, std::vector<Attribute> header) {
  for (Attribute& attribute : image.attributes)
    if (attribute.name.starts_with("cryptomatte/")) header.push_back(std::move(attribute));
  image.attributes = std::move(header);
}

/// The loop over the frames, with what it needs at hand.
class SequenceRun {
 public:
  SequenceRun(const SequenceSettings& settings, const ProgressCallback& progress)
      : settings_(settings), progress_(progress) {}

  Result<RunReport> run(const Scene& scene) {
    const auto start = Clock::now();
    report_.threads = thread_count();
    PM_TRY_STATUS(check_outputs(settings_));
    if (scene.image.denoise) PM_TRY_STATUS(check_denoiser());
    PM_TRY(extractor_, make_extractor(settings_.device, report_.device, settings_.max_memory));
    PM_TRY(prepared_, prepare_scene(scene, *extractor_, settings_.cache_folder));
    for (const std::string& warning : prepared_.warnings) log_warning("{}", warning);
    if (settings_.strict && !prepared_.warnings.empty())
      return make_error(ErrorCode::kInput,
                        "{}: {} warning{} about its files - mend them, or render without --strict",
                        scene.path.string(), prepared_.warnings.size(),
                        prepared_.warnings.size() == 1 ? "" : "s");
    // Once more: only now is it known which files the models and their materials name.
    if (!settings_.keep_going)
      for (const int frame : settings_.frames)
        for (const fs::path& file : files_of(settings_, frame)) PM_TRY_STATUS(check_writable(file));
    report_.prepare_seconds = seconds_since(start);
    PM_CHECK(settings_.jobs >= 1);
    for (int i = 0; i < settings_.jobs; ++i) {
      PM_TRY(Renderer renderer, Renderer::create(settings_.isa));
      idle_.push_back(std::make_unique<Renderer>(std::move(renderer)));
    }
    report_.isa = idle_.front()->isa();
    // A pinned instruction set is part of what was asked for; the machine's own best is not.
    if (!settings_.isa.empty())
      for (std::string* hash : {&prepared_.hash, &prepared_.inputs_hash})
        *hash = Hasher().add(*hash).add(settings_.isa).hex();
    report_.scene_hash = prepared_.hash;
    if (!has_exr(settings_)) prepared_.scene.image.aovs = "none";  // nobody would see them
    report_.frames.resize(settings_.frames.size());
    const auto frames_start = Clock::now();
    Status status = all_frames();
    // What is under way when one fails or all must stop is finished, so that no frame is half.
    Status rest = drain();
    if (status) status = std::move(rest);
    if (!status && !settings_.keep_going) return std::move(status).error();
    std::erase_if(report_.frames, [](const FrameRecord& record) { return record.frame == 0; });
    report_.frames_seconds = seconds_since(frames_start);
    report_.peak_memory = peak_memory_bytes();
    report_.total_seconds = seconds_since(start);
    return std::move(report_);
  }

 private:
  /// A picture on its way, and the seconds it took so far.
  struct Traced {
    Result<Image> image;
    double seconds = 0;
    std::unique_ptr<Renderer> renderer;
  };
  struct Tracing {
    std::vector<std::size_t> indices;  ///< the frame that is traced, and those that show the same
    std::string picture;               ///< picture_key()
    std::future<Traced> result;
  };
  struct Written {
    Status status;
    double seconds = 0;
  };

  Status all_frames() {
    for (std::size_t i = 0; i < settings_.frames.size(); ++i) {
      if (settings_.stop && *settings_.stop) {
        report_.stopped = true;
        break;
      }
      auto status = one_frame(i);
      if (!status && !settings_.keep_going) return status;
    }
    return Ok{};
  }

  /// Makes the frame's surface here while the frames before it are traced, encoded and written.
  Status one_frame(std::size_t index) {
    FrameRecord& record = report_.frames[index];
    record.frame = settings_.frames[index];
    record.files = files_of(settings_, record.frame);
    record.stage = stage_names(prepared_, record.frame);
    if (settings_.existing == Existing::kSkip && all_current(record)) {
      record.state = FrameRecord::State::kSkipped;
      PM_TRY_STATUS(drain());
      return finished(record);
    }
    if (settings_.dry_run) return finished(record);
    std::string picture = picture_key(record.frame);
    if (!picture.empty() && !tracing_.empty() && tracing_.back().picture == picture) {
      tracing_.back().indices.push_back(index);
      return Ok{};
    }
    const auto start = Clock::now();
    auto geometry = geometry_at(prepared_, *extractor_, record.frame);
    if (!geometry) {
      PM_TRY_STATUS(drain());
      return failed(record, geometry.error());
    }
    const Mesh surface = surfaces_of(*geometry);
    record.balls = ball_count(*geometry);
    record.vertices = surface.positions.size();
    record.triangles = surface.triangles.size();
    if (record.triangles > 0) record.digest = mesh_digest(surface);
    record.surface_seconds = seconds_since(start);
    Status before = Ok{};
    if (idle_.empty()) before = finish_tracing();
    begin_tracing(index, std::move(picture), std::move(*geometry));
    return before;
  }

  /// Equal for frames that show the same to the bit; empty: the frame is like no other.
  std::string picture_key(int frame) const {
    const Scene& scene = prepared_.scene;
    if (!scene.image.steady || scene.frames.turntable > 0) return "";
    const bool flows = wants_flow(scene_at(scene, static_cast<double>(frame)));
    Hasher key;
    key.add(frame_hash(prepared_, frame)).add(sequence_time(scene, frame));
    for (const PreparedActor& actor : prepared_.actors) {
      if (moves_at(actor.timeline, frame)) return "";
      add(key, morph_state_at(actor.timeline, frame));
      if (flows)
        add(key, morph_state_at(actor.timeline, std::min(frame + 1, actor.timeline.count)));
    }
    return view_of(prepared_, frame).camera_motion ? "" : key.hex();
  }
  static void add(Hasher& key, const MorphState& m) {
    key.add(m.leg).add(static_cast<int>(m.stage)).add(m.progress).add(m.time).add(m.object);
    key.add(m.look).add(m.boundary).add(m.growth);
  }

  /// On one thread everything happens in its turn, when it is asked for.
  static std::launch policy() {
    return thread_count() > 1 ? std::launch::async : std::launch::deferred;
  }

  void begin_tracing(std::size_t index, std::string picture, FrameGeometry geometry) {
    auto task = [this, geometry = std::move(geometry),
                 renderer = std::exchange(idle_.back(), nullptr)]() mutable -> Traced {
      const auto start = Clock::now();
      auto image = render_frame(prepared_, geometry, *renderer, report_.device, settings_.command);
      return {std::move(image), seconds_since(start), std::move(renderer)};
    };
    idle_.pop_back();
    tracing_.push_back({{index}, std::move(picture), std::async(policy(), std::move(task))});
  }

  /// Waits for the oldest frame that is traced, and hands it on, and those that show the same.
  Status finish_tracing() {
    Tracing tracing = std::move(tracing_.front());
    Traced traced = tracing.result.get();
    tracing_.pop_front();
    idle_.push_back(std::move(traced.renderer));
    if (!traced.image) {
      Status first = Ok{};
      for (const std::size_t index : tracing.indices) {
        Status status = failed(report_.frames[index], traced.image.error());
        if (first) first = std::move(status);
      }
      return first;
    }
    const auto image = std::make_shared<const Image>(std::move(*traced.image));
    Status before = Ok{};
    for (const std::size_t index : tracing.indices) {
      FrameRecord& record = report_.frames[index];
      if (index == tracing.indices.front()) {
        record.trace_seconds = traced.seconds;
        record.seconds = record.surface_seconds + traced.seconds;
      } else {
        repeat(report_.frames[tracing.indices.front()], record);
      }
      Status status = begin_writing(index, image, index != tracing.indices.front());
      if (before) before = std::move(status);
    }
    return before;
  }

  /// What is known of a frame that shows the same as the one traced.
  static void repeat(const FrameRecord& traced, FrameRecord& record) {
    record.balls = traced.balls;
    record.vertices = traced.vertices;
    record.triangles = traced.triangles;
    record.digest = traced.digest;
  }

  Status begin_writing(std::size_t index, const std::shared_ptr<const Image>& image, bool again) {
    Status before = Ok{};
    if (writing_.size() == static_cast<std::size_t>(settings_.jobs)) before = finish_writing();
    const int frame = report_.frames[index].frame;
    auto task = [this, frame, image, again]() -> Written {
      const auto start = Clock::now();
      if (!again)
        return {write_frame(*image, settings_, prepared_.scene, frame), seconds_since(start)};
      Image copy = *image;
      put_header(copy, header_of(prepared_, frame, report_.isa, report_.device, settings_.command));
      return {write_frame(copy, settings_, prepared_.scene, frame), seconds_since(start)};
    };
    writing_.emplace_back(index, std::async(policy(), std::move(task)));
    return before;
  }

  Status finish_writing() {
    FrameRecord& record = report_.frames[writing_.front().first];
    const Written written = writing_.front().second.get();
    writing_.pop_front();
    record.write_seconds = written.seconds;
    if (!written.status) return failed(record, written.status.error());
    record.state = FrameRecord::State::kDone;
    return finished(record);
  }

  /// Finishes what is under way; the first error of it.
  Status drain() {
    Status first = Ok{};
    const auto keep = [&](Status status) {
      if (first && !status) first = std::move(status);
    };
    while (!tracing_.empty()) keep(finish_tracing());
    while (!writing_.empty()) keep(finish_writing());
    return settings_.keep_going ? Status(Ok{}) : first;
  }

  bool all_current(const FrameRecord& record) const {
    const std::string hash = frame_hash(prepared_, record.frame);
    for (const fs::path& file : record.files) {
      std::error_code error;
      if (!fs::exists(file, error)) return false;
      if (is_current(file, hash, record.frame)) continue;
      log_info("{}: is of another scene or settings - rendering it again", file.string());
      return false;
    }
    return true;
  }

  Status failed(FrameRecord& record, const Error& error) {
    record.state = FrameRecord::State::kFailed;
    record.error = error.message;
    if (settings_.keep_going) log_message(LogLevel::kError, error.message);
    ++finished_;
    if (progress_) progress_(finished_, report_.frames.size(), record);
    return error;
  }

  Status finished(const FrameRecord& record) {
    ++finished_;
    if (progress_) progress_(finished_, report_.frames.size(), record);
    return Ok{};
  }

  const SequenceSettings& settings_;
  const ProgressCallback& progress_;
  std::unique_ptr<SurfaceExtractor> extractor_;
  PreparedScene prepared_;
  RunReport report_;
  std::size_t finished_ = 0;
  /// At most settings_.jobs frames each are traced and written while the next one's surface is
  /// made.
  std::vector<std::unique_ptr<Renderer>> idle_;
  std::deque<Tracing> tracing_;
  std::deque<std::pair<std::size_t, std::future<Written>>> writing_;
};

const char* state_name(FrameRecord::State state) {
  switch (state) {
    case FrameRecord::State::kDone:
      return "done";
    case FrameRecord::State::kSkipped:
      return "skipped";
    case FrameRecord::State::kFailed:
      return "failed";
    case FrameRecord::State::kPlanned:
      return "planned";
  }
  return "";
}

}  // namespace

Result<std::unique_ptr<SurfaceExtractor>> make_extractor(const std::string& device,
                                                         std::string& chosen,
                                                         std::size_t max_memory) {
  chosen = "cpu";
  const auto cpu = [&] {
    auto extractor = make_cpu_extractor();
    extractor->limit_memory(max_memory);
    return extractor;
  };
  if (device == "cpu") return cpu();
  const bool automatic = device == "auto";
  int index = 0;
  if (!automatic) {
    const auto number = device == "cuda"              ? std::optional<long long>(0)
                        : device.starts_with("cuda:") ? parse_integer(device.substr(5))
                                                      : std::nullopt;
    if (!number || *number < 0 || *number > 1023)
      return make_error(ErrorCode::kUsage, "--device {}: write cpu, cuda, cuda:1 or auto", device);
    index = static_cast<int>(*number);
  }
  ExtractStatus status;
  auto extractor = make_cuda_extractor(index, status);
  if (extractor) {
    chosen = fmt::format("cuda:{}", index);
    extractor->limit_memory(max_memory);
    return extractor;
  }
  if (!automatic)
    return make_error(ErrorCode::kResource, "--device {}: {} - use --device cpu or auto", device,
                      status.message);
  // Said once, not for every scene of a command.
  static std::atomic_flag said;
  if (!said.test_and_set()) log_info("surfaces are made on the CPU: {}", status.message);
  return cpu();
}

std::size_t RunReport::count(FrameRecord::State state) const {
  std::size_t n = 0;
  for (const FrameRecord& record : frames) n += record.state == state;
  return n;
}

std::string to_json(const RunReport& report) {
  using Json = nlohmann::ordered_json;
  Json json{{"version", PM_VERSION},
            {"build", program_identity()},
            {"scene_hash", report.scene_hash},
            {"device", report.device},
            {"isa", report.isa},
            {"threads", report.threads},
            {"prepare_seconds", report.prepare_seconds},
            {"frames_seconds", report.frames_seconds},
            {"total_seconds", report.total_seconds},
            {"peak_memory_bytes", report.peak_memory},
            {"stopped", report.stopped}};
  json["frames"] = Json::array();
  for (const FrameRecord& r : report.frames) {
    Json files = Json::array();
    for (const fs::path& file : r.files) files.push_back(file.string());
    Json frame{
        {"frame", r.frame}, {"state", state_name(r.state)}, {"stage", r.stage}, {"files", files}};
    if (r.state == FrameRecord::State::kDone)
      frame.update({{"seconds", r.seconds},
                    {"surface_seconds", r.surface_seconds},
                    {"trace_seconds", r.trace_seconds},
                    {"write_seconds", r.write_seconds},
                    {"balls", r.balls},
                    {"vertices", r.vertices},
                    {"triangles", r.triangles},
                    {"digest", r.digest}});
    if (!r.error.empty()) frame["error"] = r.error;
    json["frames"].push_back(frame);
  }
  return dump_json(json);
}

Result<Image> render_frame(const PreparedScene& prepared, const FrameGeometry& geometry,
                           Renderer& renderer, const std::string& device,
                           const std::string& command) {
  RenderSettings settings;
  settings.image = prepared.scene.image;
  settings.frame = geometry.frame;
  PM_TRY(Image image, renderer.render(render_scene(prepared, geometry), settings));
  put_header(image, header_of(prepared, geometry.frame, renderer.isa(), device, command));
  return image;
}

int jobs_for(int width, int height, std::size_t frames) {
  constexpr int kTile = 16, kTilesPerThread = 64, kMaxJobs = 16;
  const int tiles = ((width + kTile - 1) / kTile) * ((height + kTile - 1) / kTile);
  const int wanted = (kTilesPerThread * thread_count() + tiles - 1) / tiles;
  return std::clamp(
      std::min(wanted, thread_count()), 1,
      std::clamp(static_cast<int>(std::min<std::size_t>(frames, kMaxJobs)), 1, kMaxJobs));
}

Result<RunReport> render_sequence(const Scene& scene, const SequenceSettings& settings,
                                  const ProgressCallback& progress) {
  PM_CHECK(!settings.frames.empty());
  return SequenceRun(settings, progress).run(scene);
}

}  // namespace polymorph
