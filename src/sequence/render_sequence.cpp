#include "sequence/render_sequence.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/text.h"
#include "image/image_io.h"
#include "scene/json_text.h"
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

Status write_frame(const Image& image, const SequenceSettings& settings, const ImageSettings& look,
                   int frame) {
  PngSettings png;
  png.exposure = look.exposure;
  if (has_exr(settings)) PM_TRY_STATUS(write_image(frame_path(settings.exr, frame), image));
  if (has_png(settings)) PM_TRY_STATUS(write_image(frame_path(settings.png, frame), image, png));
  return Ok{};
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
    PM_TRY(extractor_, make_extractor(settings_.device, report_.device, settings_.max_memory));
    PM_TRY(prepared_, prepare_scene(scene, *extractor_, settings_.cache_folder));
    for (const std::string& warning : prepared_.warnings) log_warning("{}", warning);
    report_.prepare_seconds = seconds_since(start);
    PM_TRY(Renderer renderer, Renderer::create(settings_.isa));
    report_.isa = renderer.isa();
    // A pinned instruction set is part of what was asked for; the machine's own best is not.
    if (!settings_.isa.empty())
      prepared_.hash = Hasher().add(prepared_.hash).add(settings_.isa).hex();
    report_.scene_hash = prepared_.hash;
    report_.frames.resize(settings_.frames.size());
    for (std::size_t i = 0; i < settings_.frames.size(); ++i) {
      if (settings_.stop && *settings_.stop) {
        report_.stopped = true;
        break;
      }
      auto status = one_frame(i, renderer);
      if (!status && !settings_.keep_going) return std::move(status).error();
    }
    const auto status = finish_writing();
    if (!status && !settings_.keep_going) return status.error();
    std::erase_if(report_.frames, [](const FrameRecord& record) { return record.frame == 0; });
    report_.peak_memory = peak_memory_bytes();
    report_.total_seconds = seconds_since(start);
    return std::move(report_);
  }

 private:
  Status one_frame(std::size_t index, Renderer& renderer) {
    FrameRecord& record = report_.frames[index];
    record.frame = settings_.frames[index];
    record.files = files_of(settings_, record.frame);
    record.stage = stage_names(prepared_, record.frame);
    if (settings_.existing == Existing::kSkip && all_current(record)) {
      record.state = FrameRecord::State::kSkipped;
      return finished(record);
    }
    if (settings_.dry_run) return finished(record);
    const auto start = Clock::now();
    auto image = trace(record, renderer);
    record.trace_seconds = seconds_since(start) - record.surface_seconds;
    record.seconds = seconds_since(start);
    auto before = finish_writing();
    if (!image) return failed(record, image.error());
    begin_writing(index, std::move(*image));
    return before;
  }

  Result<Image> trace(FrameRecord& record, Renderer& renderer) {
    const auto start = Clock::now();
    PM_TRY(const FrameGeometry geometry, geometry_at(prepared_, *extractor_, record.frame));
    const Mesh surface = surfaces_of(geometry);
    record.balls = ball_count(geometry);
    record.vertices = surface.positions.size();
    record.triangles = surface.triangles.size();
    if (record.triangles > 0) record.digest = mesh_digest(surface);
    record.surface_seconds = seconds_since(start);
    return render_frame(prepared_, geometry, renderer, report_.device, settings_.command);
  }

  void begin_writing(std::size_t index, Image image) {
    const int frame = report_.frames[index].frame;
    auto task = [this, frame, image = std::move(image)]() -> std::pair<Status, double> {
      const auto start = Clock::now();
      Status status = write_frame(image, settings_, prepared_.scene.image, frame);
      return {std::move(status), seconds_since(start)};
    };
    writing_ = {index, std::async(std::launch::async, std::move(task))};
  }

  Status finish_writing() {
    if (!writing_) return Ok{};
    FrameRecord& record = report_.frames[writing_->first];
    auto [status, seconds] = writing_->second.get();
    writing_.reset();
    record.write_seconds = seconds;
    if (!status) return failed(record, status.error());
    record.state = FrameRecord::State::kDone;
    return finished(record);
  }

  bool all_current(const FrameRecord& record) const {
    for (const fs::path& file : record.files) {
      std::error_code error;
      if (!fs::exists(file, error)) return false;
      if (is_current(file, prepared_.hash, record.frame)) continue;
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
  /// Encoding and writing one frame goes on beside the tracing of the next; never more than one is
  /// under way.
  std::optional<std::pair<std::size_t, std::future<std::pair<Status, double>>>> writing_;
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

std::vector<Attribute> header_of(const PreparedScene& prepared, const FrameGeometry& geometry,
                                 const Renderer& renderer, const std::string& device,
                                 const std::string& command) {
  std::vector<Attribute> attributes{
      {"Software", std::string("polymorph ") + PM_VERSION},
      {"FramesPerSecond", prepared.scene.frames.fps},
      {"polymorph/version", std::string(PM_VERSION)},
      {kHashAttribute, prepared.hash},
      {"polymorph/frame", geometry.frame},
      {"polymorph/t", geometry.t},
      {"polymorph/stage", geometry.stage},
      {"polymorph/device", device},
      {"polymorph/isa", renderer.isa()},
      {"polymorph/samples", prepared.scene.image.samples},
      {"polymorph/exposure", prepared.scene.image.exposure},
      {"polymorph/seed", fmt::format("{}", prepared.scene.image.seed)}};
  if (!command.empty()) attributes.push_back({"polymorph/command", command});
  return attributes;
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
  log_debug("using the cpu: {}", status.message);
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
            {"scene_hash", report.scene_hash},
            {"device", report.device},
            {"isa", report.isa},
            {"threads", report.threads},
            {"prepare_seconds", report.prepare_seconds},
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
  image.attributes = header_of(prepared, geometry, renderer, device, command);
  return image;
}

Result<RunReport> render_sequence(const Scene& scene, const SequenceSettings& settings,
                                  const ProgressCallback& progress) {
  PM_CHECK(!settings.frames.empty());
  return SequenceRun(settings, progress).run(scene);
}

}  // namespace polymorph
