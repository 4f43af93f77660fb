#include "golden/golden_bits.h"

#include <algorithm>
#include <atomic>

#include "base/parallel.h"
#include "base/stopwatch.h"
#include "film/render_sequence.h"
#include "golden/golden_frames.h"
#include "golden/work_folder.h"
#include "image/image_io.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Sets the number of threads unless `count` is 0, and restores it in the destructor.
class ThreadCount {
 public:
  explicit ThreadCount(int count) : old_count_(thread_count()) {
    if (count > 0) set_thread_count(count);
  }
  ~ThreadCount() { set_thread_count(old_count_); }
  ThreadCount(const ThreadCount&) = delete;
  ThreadCount& operator=(const ThreadCount&) = delete;

 private:
  int old_count_;
};

/// One way to render the suite's frames.
struct Variant {
  const char* name;
  int threads = 0;           ///< 0: unchanged
  int shards = 1;            ///< number of runs, each of which renders one shard of the frames
  bool interrupted = false;  ///< stopped after the first frame, then resumed
  bool cached = false;       ///< uses the cache that all such variants share
  bool last_alone = false;   ///< renders only the last frame
};

/// The variant that all others are compared with.
constexpr Variant kBase{.name = "base"};
/// The other variants, in the order in which they run: the first one with `cached` fills the cache.
constexpr Variant kVariants[] = {{.name = "again"},
                                 {.name = "1 thread", .threads = 1},
                                 {.name = "3 threads", .threads = 3},
                                 {.name = "cold cache", .cached = true},
                                 {.name = "warm cache", .cached = true},
                                 {.name = "3 shards", .shards = 3, .cached = true},
                                 {.name = "resumed", .interrupted = true, .cached = true},
                                 {.name = "a frame alone", .cached = true, .last_alone = true}};

/// Inputs of the bit test, and its temporary folder.
struct BitTest {
  const GoldenSuite& suite;
  const GoldenSettings& settings;
  const Scene& scene;
  const fs::path& folder;
};

/// Returns the pattern FOLDER/frame.####.exr.
FramePattern frame_pattern(const fs::path& folder) {
  FramePattern pattern;
  pattern.before = (folder / "frame.").string();
  pattern.after = ".exr";
  pattern.digits = 4;
  return pattern;
}

/// Makes the settings of a variant, with the frames of all shards.
SequenceSettings sequence_settings(const BitTest& test, const Variant& variant) {
  SequenceSettings settings;
  settings.frames = test.suite.frames;
  if (variant.last_alone) settings.frames = {test.suite.frames.back()};
  settings.exr = frame_pattern(test.folder / variant.name);
  settings.device = test.settings.device;
  if (variant.cached) settings.cache_folder = test.folder / "cache";
  return settings;
}

/// Number and surface digest of each rendered frame, sorted by number.
using Digests = std::vector<std::pair<int, std::string>>;

/// Renders the frames as the variant says. Returns the digests of their surfaces.
Result<Digests> render(const BitTest& test, const Variant& variant) {
  const ThreadCount threads(variant.threads);
  Digests digests;
  const auto run = [&](const SequenceSettings& settings,
                       const ProgressCallback& progress) -> Status {
    PM_TRY(const RunReport report, render_sequence(test.scene, settings, progress));
    for (const FrameRecord& record : report.frames)
      if (record.state == FrameRecord::State::kDone)
        digests.emplace_back(record.frame, record.digest);
    return Ok{};
  };
  SequenceSettings settings = sequence_settings(test, variant);
  if (variant.interrupted) {
    // Stop when the first frame is done, then render the frames that do not exist.
    std::atomic<bool> stop = false;
    settings.stop = &stop;
    PM_TRY_STATUS(
        run(settings, [&](std::size_t, std::size_t, const FrameRecord&) { stop = true; }));
    settings.stop = nullptr;
    settings.existing = Existing::kSkip;
    PM_TRY_STATUS(run(settings, /*progress=*/{}));
  } else {
    for (int shard = 1; shard <= variant.shards; ++shard) {
      SequenceSettings shard_settings = settings;
      shard_settings.frames = take_shard(settings.frames, {shard, variant.shards});
      if (!shard_settings.frames.empty()) PM_TRY_STATUS(run(shard_settings, /*progress=*/{}));
    }
  }
  std::sort(digests.begin(), digests.end());
  if (digests.size() != settings.frames.size())
    return make_error(ErrorCode::kInternal, "{}, {}: {} of {} frames were rendered",
                      test.suite.name, variant.name, digests.size(), settings.frames.size());
  return digests;
}

/// A frame of a variant, and the same frame of the base.
struct FramePair {
  int number = 0;
  Image actual, base;
  bool surfaces_equal = true;
};

/// Adds the description of a frame that differs from the base to `result`, with pictures if the
/// settings have a budget for them.
Status add_difference(const BitTest& test, const FramePair& frame, ReportCase& result) {
  result.tolerance = zero_tolerance();
  result.tolerance.why = "the same build must give the same bits";
  PixelMaps maps;
  result.comparison = compare_images(frame.actual, frame.base, result.tolerance, &maps);
  result.message = fmt::format("frame {}: {}{}", frame.number, result.comparison->reason,
                               frame.surfaces_equal ? "" : "; its surface differs");
  if (!test.settings.pictures) return Ok{};
  return add_pictures(result, frame.actual, &frame.base, maps, *test.settings.pictures);
}

/// Renders one variant and compares its frames with those of the base, up to the first difference.
Result<ReportCase> test_variant(const BitTest& test, const Variant& variant, const Digests& base) {
  const Stopwatch stopwatch;
  ReportCase result;
  result.group = test.suite.name + ", bits";
  result.name = variant.name;
  PM_TRY(const Digests digests, render(test, variant));
  for (const auto& frame_digest : digests) {
    FramePair frame;
    frame.number = frame_digest.first;
    PM_TRY(frame.actual,
           read_image(frame_path(frame_pattern(test.folder / variant.name), frame.number)));
    PM_TRY(frame.base,
           read_image(frame_path(frame_pattern(test.folder / kBase.name), frame.number)));
    frame.surfaces_equal = std::find(base.begin(), base.end(), frame_digest) != base.end();
    if (frame.surfaces_equal && pixel_digest(frame.actual) == pixel_digest(frame.base)) continue;
    PM_TRY_STATUS(add_difference(test, frame, result));
    break;
  }
  result.verdict = result.passed() ? "same" : "differs";
  result.detail = digests.size() == 1 ? "the same bits"
                                      : fmt::format("{} frames, the same bits", digests.size());
  result.seconds = stopwatch.seconds();
  return result;
}

}  // namespace

Result<std::vector<ReportCase>> test_golden_bits(const GoldenSuite& suite,
                                                 const GoldenSettings& settings) {
  PM_TRY(const Scene scene, load_golden_scene(suite));
  PM_TRY(const WorkFolder work, WorkFolder::create());
  const BitTest test{suite, settings, scene, work.path()};
  PM_TRY(const Digests base, render(test, kBase));
  std::vector<ReportCase> cases;
  for (const Variant& variant : kVariants) {
    PM_TRY(ReportCase result, test_variant(test, variant, base));
    cases.push_back(std::move(result));
  }
  return cases;
}

}  // namespace polymorph
