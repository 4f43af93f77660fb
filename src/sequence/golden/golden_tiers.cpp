#include "sequence/golden/golden_tiers.h"

#include <stdlib.h>

#include <algorithm>
#include <atomic>

#include "base/parallel.h"
#include "base/stopwatch.h"
#include "compare/statistics.h"
#include "image/image_io.h"
#include "scene/load_scene.h"
#include "sequence/device.h"
#include "sequence/render_frame.h"
#include "sequence/render_sequence.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// A folder that goes when it is left.
class WorkFolder {
 public:
  static Result<WorkFolder> create() {
    std::string name = (fs::temp_directory_path() / "polymorph-golden-XXXXXX").string();
    if (!::mkdtemp(name.data()))
      return make_error(ErrorCode::kOutput, "{}: cannot make a folder to work in", name);
    return WorkFolder(name);
  }
  WorkFolder(WorkFolder&& other) noexcept { path_.swap(other.path_); }
  WorkFolder& operator=(WorkFolder&& other) = delete;
  ~WorkFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  explicit WorkFolder(fs::path path) : path_(std::move(path)) {}
  fs::path path_;
};

/// Whatever a way of rendering does to the number of threads ends with it.
class ThreadCount {
 public:
  explicit ThreadCount(int count) : before_(thread_count()) {
    if (count > 0) set_thread_count(count);
  }
  ~ThreadCount() { set_thread_count(before_); }
  ThreadCount(const ThreadCount&) = delete;
  ThreadCount& operator=(const ThreadCount&) = delete;

 private:
  int before_;
};

/// One way to render the suite's frames.
struct Way {
  std::string name;
  int threads = 0;           ///< 0: as many as there are
  int shards = 1;            ///< so many runs, each with its share of the frames
  bool interrupted = false;  ///< stopped after a frame, then resumed
  bool cached = false;
  bool last_alone = false;  ///< only the last frame
};

const std::vector<Way>& ways() {
  static const std::vector<Way> all{{.name = "again"},
                                    {.name = "1 thread", .threads = 1},
                                    {.name = "3 threads", .threads = 3},
                                    {.name = "cold cache", .cached = true},
                                    {.name = "warm cache", .cached = true},
                                    {.name = "3 shards", .shards = 3, .cached = true},
                                    {.name = "resumed", .interrupted = true, .cached = true},
                                    {.name = "a frame alone", .cached = true, .last_alone = true}};
  return all;
}

FramePattern pattern_in(const fs::path& folder) {
  FramePattern pattern;
  pattern.before = (folder / "frame.").string();
  pattern.after = ".exr";
  pattern.digits = 4;
  return pattern;
}

/// Frame number and surface digest of all that was rendered, by frame.
using Digests = std::vector<std::pair<int, std::string>>;

class BitTest {
 public:
  BitTest(const GoldenSuite& suite, const GoldenSettings& settings, const Scene& scene,
          const WorkFolder& work)
      : suite_(suite), settings_(settings), scene_(scene), work_(work) {}

  Status make_base() {
    PM_TRY(base_, render({.name = "base"}));
    return Ok{};
  }

  Result<ReportCase> test(const Way& way) {
    const Stopwatch stopwatch;
    ReportCase one;
    one.group = suite_.name + ", bits";
    one.name = way.name;
    PM_TRY(const Digests digests, render(way));
    for (const auto& [frame, surface] : digests) {
      const fs::path actual = frame_path(pattern_in(work_ / way.name), frame);
      const fs::path base = frame_path(pattern_in(work_ / "base"), frame);
      PM_TRY(const Image a, read_image(actual));
      PM_TRY(const Image b, read_image(base));
      const auto same = std::find(base_.begin(), base_.end(), std::pair(frame, surface));
      if (pixel_digest(a) == pixel_digest(b) && same != base_.end()) continue;
      PM_TRY_STATUS(describe(one, frame, a, b, same != base_.end()));
      break;
    }
    one.verdict = one.passed() ? "same" : "differs";
    one.detail = digests.size() == 1 ? "the same bits"
                                     : fmt::format("{} frames, the same bits", digests.size());
    one.seconds = stopwatch.seconds();
    return one;
  }

 private:
  SequenceSettings sequence(const Way& way) const {
    SequenceSettings s;
    s.frames = suite_.frames;
    if (way.last_alone) s.frames = {suite_.frames.back()};
    s.exr = pattern_in(work_ / way.name);
    s.device = settings_.device;
    s.isa = settings_.isa;
    if (way.cached) s.cache_folder = work_ / "cache";
    return s;
  }

  Result<Digests> render(const Way& way) const {
    const ThreadCount threads(way.threads);
    Digests digests;
    const auto run = [&](const SequenceSettings& s, const ProgressCallback& progress) -> Status {
      PM_TRY(const RunReport report, render_sequence(scene_, s, progress));
      for (const FrameRecord& record : report.frames)
        if (record.state == FrameRecord::State::kDone)
          digests.emplace_back(record.frame, record.digest);
      return Ok{};
    };
    SequenceSettings settings = sequence(way);
    if (way.interrupted) {
      std::atomic<bool> stop = false;
      settings.stop = &stop;
      PM_TRY_STATUS(
          run(settings, [&](std::size_t, std::size_t, const FrameRecord&) { stop = true; }));
      settings.stop = nullptr;
      settings.existing = Existing::kSkip;
      PM_TRY_STATUS(run(settings, {}));
    } else {
      for (int shard = 1; shard <= way.shards; ++shard) {
        SequenceSettings part = settings;
        part.frames = shard_of(settings.frames, {shard, way.shards});
        if (!part.frames.empty()) PM_TRY_STATUS(run(part, {}));
      }
    }
    std::sort(digests.begin(), digests.end());
    const std::size_t wanted = settings.frames.size();
    if (digests.size() != wanted)
      return make_error(ErrorCode::kInternal, "{}, {}: {} of {} frames were rendered", suite_.name,
                        way.name, digests.size(), wanted);
    return digests;
  }

  Status describe(ReportCase& one, int frame, const Image& actual, const Image& base,
                  bool same_surface) const {
    one.tolerance = {.fail = 0, .relative = 0, .fail_percent = 0, .depth = 0, .normal = 0};
    one.tolerance.why = "the same build must give the same bits";
    PixelMaps maps;
    one.comparison = compare_images(actual, base, one.tolerance, &maps);
    one.message = fmt::format("frame {}: {}{}", frame, one.comparison->reason,
                              same_surface ? "" : "; its surface differs");
    if (!settings_.pictures) return Ok{};
    return add_pictures(one, actual, &base, maps, *settings_.pictures);
  }

  const GoldenSuite& suite_;
  const GoldenSettings& settings_;
  const Scene& scene_;
  const WorkFolder& work_;
  Digests base_;
};

/// The samples a golden was rendered with, from its header.
int samples_of(const Image& image, int otherwise) {
  for (const Attribute& attribute : image.attributes)
    if (const int* samples = std::get_if<int>(&attribute.value);
        samples && attribute.name == "polymorph/samples" && *samples > 0)
      return *samples;
  return otherwise;
}

Result<ReportCase> test_noise(const GoldenSuite& suite, const GoldenSettings& settings,
                              PreparedScene& prepared, Engine& engine, Renderer& renderer,
                              int frame, int runs) {
  const Stopwatch stopwatch;
  ReportCase one;
  one.group = suite.name + ", noise";
  one.name = fmt::format("frame {}", frame);
  one.reference = golden_image_path(suite, frame);
  PM_TRY(const FrameGeometry geometry, geometry_at(prepared, engine, frame));
  const std::uint64_t own = prepared.scene.image.seed;
  std::vector<Image> images;
  for (int run = 1; run <= runs; ++run) {
    prepared.scene.image.seed = own + 1000000 + static_cast<std::uint64_t>(run);
    PM_TRY(Image image, render_frame(prepared, geometry, renderer, settings.device, ""));
    images.push_back(std::move(image));
  }
  prepared.scene.image.seed = own;
  std::error_code error;
  if (!fs::exists(one.reference, error)) {
    one.message = fmt::format("{} is missing", one.reference.string());
    return one;
  }
  PM_TRY(const Image golden, read_image(one.reference));
  const int samples = prepared.scene.image.samples;
  PM_TRY(const StatisticsResult result,
         compare_statistics(images, samples, golden, samples_of(golden, samples)));
  one.verdict = result.passed ? "noise" : "differs";
  one.detail = result.reason;
  if (!result.passed) one.message = result.reason;
  one.seconds = stopwatch.seconds();
  if (settings.pictures) {
    PM_TRY_STATUS(add_pictures(one, images[0], &golden, {}, *settings.pictures));
  }
  return one;
}

}  // namespace

Result<std::vector<ReportCase>> test_golden_bits(const GoldenSuite& suite,
                                                 const GoldenSettings& settings) {
  PM_TRY(Scene scene, load_scene(suite.scene));
  scene.image.denoise = false;
  PM_TRY(const WorkFolder work, WorkFolder::create());
  BitTest test(suite, settings, scene, work);
  PM_TRY_STATUS(test.make_base());
  std::vector<ReportCase> cases;
  for (const Way& way : ways()) {
    PM_TRY(ReportCase one, test.test(way));
    cases.push_back(std::move(one));
  }
  return cases;
}

Result<std::vector<ReportCase>> test_golden_statistics(const GoldenSuite& suite,
                                                       const GoldenSettings& settings, int runs) {
  PM_CHECK(runs >= 4);
  PM_TRY(Scene scene, load_scene(suite.scene));
  scene.image.denoise = false;
  std::string device;
  PM_TRY(const auto engine, make_engine(settings.device, device));
  PM_TRY(PreparedScene prepared, prepare_scene(scene, *engine, settings.cache_folder));
  PM_TRY(Renderer renderer, Renderer::create(settings.isa));
  std::vector<ReportCase> cases;
  for (const int frame : suite.frames) {
    if (frame < 1 || frame > prepared.frame_count)
      return make_error(ErrorCode::kInput, "{}: frame {} is outside the scene's 1-{}",
                        (suite.folder / "suite.json").string(), frame, prepared.frame_count);
    PM_TRY(ReportCase one, test_noise(suite, settings, prepared, *engine, renderer, frame, runs));
    cases.push_back(std::move(one));
  }
  return cases;
}

}  // namespace polymorph
