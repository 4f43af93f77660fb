#include "sequence/golden_run.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "base/file.h"
#include "base/shell_quote.h"
#include "base/stopwatch.h"
#include "compare/pictures.h"
#include "image/image_io.h"
#include "scene/load_scene.h"
#include "sequence/device.h"
#include "sequence/render_frame.h"
#include "sequence/render_sequence.h"
#include "surface/mesh_check.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

struct RenderedFrame {
  SurfaceRecord surface;
  Image image;
};

/// The suite's scene, prepared once for all of its frames.
class SuiteRenderer {
 public:
  static Result<SuiteRenderer> create(const GoldenSuite& suite, const GoldenSettings& settings) {
    SuiteRenderer result;
    PM_TRY(Scene scene, load_scene(suite.scene));
    scene.image.denoise = false;  // another library's pixels prove nothing about this program's
    PM_TRY(result.extractor_, make_extractor(settings.device, result.device_));
    PM_TRY(result.prepared_, prepare_scene(scene, *result.extractor_, settings.cache_folder));
    PM_TRY(Renderer renderer, Renderer::create(settings.isa));
    result.renderer_ = std::make_unique<Renderer>(std::move(renderer));
    for (const int frame : suite.frames)
      if (frame < 1 || frame > result.prepared_.frame_count)
        return make_error(ErrorCode::kInput, "{}: frame {} is outside the scene's 1-{}",
                          (suite.folder / "suite.json").string(), frame,
                          result.prepared_.frame_count);
    return result;
  }

  Result<RenderedFrame> render(int frame) {
    PM_TRY(const FrameGeometry geometry, geometry_at(prepared_, *extractor_, frame));
    PM_TRY(Image image, render_frame(prepared_, geometry, *renderer_, device_, ""));
    const Mesh surface = surfaces_of(geometry);
    return RenderedFrame{
        {frame, surface.positions.size(), surface.triangles.size(), mesh_digest(surface)},
        std::move(image)};
  }

 private:
  std::string device_;
  std::unique_ptr<SurfaceExtractor> extractor_;
  PreparedScene prepared_;
  std::unique_ptr<Renderer> renderer_;
};

Result<std::vector<SurfaceRecord>> read_records(const GoldenSuite& suite) {
  const fs::path file = suite.folder / "surface.csv";
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::vector<SurfaceRecord>{};
  return read_surface_records(file);
}

std::string compare_surface(const SurfaceRecord& actual,
                            const std::vector<SurfaceRecord>& records) {
  for (const SurfaceRecord& record : records) {
    if (record.frame != actual.frame) continue;
    if (record.vertices != actual.vertices || record.triangles != actual.triangles)
      return fmt::format("surface has {} vertices and {} triangles, the golden one {} and {}",
                         actual.vertices, actual.triangles, record.vertices, record.triangles);
    if (record.digest != actual.digest)
      return "surface has the golden one's counts but not its digest (positions or normals moved)";
    return "";
  }
  return "surface.csv has no row for this frame";
}

bool all_finite(const Image& image) {
  return std::all_of(image.pixels.begin(), image.pixels.end(),
                     [](float v) { return std::isfinite(v); });
}

fs::path failure_path(const GoldenSuite& suite, const GoldenSettings& settings, int frame,
                      const char* what) {
  return settings.failures / suite.name / fmt::format("frame.{:04d}.{}", frame, what);
}

/// What an earlier run kept of the frame would show a failure that is gone.
void forget_failure(const GoldenSuite& suite, const GoldenSettings& settings, int frame) {
  if (settings.failures.empty()) return;
  for (const char* what : {"actual.exr", "reference.exr", "difference.png"}) {
    std::error_code ignored;
    fs::remove(failure_path(suite, settings, frame, what), ignored);
  }
}

/// Leaves actual, reference and difference behind, so that a failure can be looked at.
Status keep_failure(const GoldenSuite& suite, const GoldenSettings& settings,
                    const RenderedFrame& rendered, const Image* reference,
                    const Comparison& comparison, const PixelMaps& maps) {
  if (settings.failures.empty()) return Ok{};
  const auto path = [&](const char* what) {
    return failure_path(suite, settings, rendered.surface.frame, what);
  };
  PM_TRY_STATUS(write_image(path("actual.exr"), rendered.image));
  if (reference) {
    PM_TRY_STATUS(write_image(path("reference.exr"), *reference));
    PM_TRY(const Image difference, failure_picture(rendered.image, *reference, comparison, maps));
    PM_TRY_STATUS(write_image(path("difference.png"), difference));
  }
  return Ok{};
}

std::vector<fs::path> find_orphans(const GoldenSuite& suite) {
  std::vector<fs::path> orphans;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(suite.folder, error)) {
    if (entry.path().extension() != ".exr") continue;
    const bool wanted = std::any_of(suite.frames.begin(), suite.frames.end(), [&](int frame) {
      return golden_image_path(suite, frame).filename() == entry.path().filename();
    });
    if (!wanted) orphans.push_back(entry.path());
  }
  std::sort(orphans.begin(), orphans.end());
  return orphans;
}

/// The frame as a report tells it.
Status fill_report(const GoldenSuite& suite, const GoldenSettings& settings, const Image& actual,
                   const Image* reference, const PixelMaps& maps, GoldenFrame& result) {
  ReportCase& report = result.report;
  report.group = suite.name;
  report.name = fmt::format("frame {}", result.frame);
  report.reference = golden_image_path(suite, result.frame);
  report.tolerance = suite.tolerance;
  report.message = result.message;
  report.error = result.unreadable;
  report.comparison = result.image;
  if (!result.passed() && !settings.failures.empty())
    report.actual = failure_path(suite, settings, result.frame, "actual.exr");
  if (!settings.pictures) return Ok{};
  return add_pictures(report, actual, reference, maps, *settings.pictures);
}

/// One frame against its golden; `rendered` is what it was compared with.
Result<GoldenFrame> judge(const GoldenSuite& suite, const GoldenSettings& settings,
                          const std::vector<SurfaceRecord>& records,
                          const RenderedFrame& rendered) {
  GoldenFrame result;
  result.frame = rendered.surface.frame;
  result.message = compare_surface(rendered.surface, records);
  result.surface_passed = result.message.empty();
  const fs::path golden = golden_image_path(suite, result.frame);
  if (!fs::exists(golden)) {
    result.missing = true;
    result.message =
        fmt::format("{} is missing - make it with: polymorph golden update {} --reason \"...\"",
                    golden.string(), shell_quoted(suite.name));
    PM_TRY_STATUS(keep_failure(suite, settings, rendered, nullptr, {}, {}));
    PM_TRY_STATUS(fill_report(suite, settings, rendered.image, nullptr, {}, result));
    return result;
  }
  const auto reference = read_image(golden);
  if (!reference) {
    result.unreadable = true;
    result.message = reference.error().message;
    PM_TRY_STATUS(keep_failure(suite, settings, rendered, nullptr, {}, {}));
    PM_TRY_STATUS(fill_report(suite, settings, rendered.image, nullptr, {}, result));
    return result;
  }
  // The golden went through half floats; so must what it is held against.
  PM_TRY(const std::string encoded, encode_exr(rendered.image));
  PM_TRY(const Image actual, decode_image(encoded, golden.string()));
  PixelMaps maps;
  result.image = compare_images(actual, *reference, suite.tolerance, &maps);
  if (!result.image->passed())
    result.message += (result.message.empty() ? "" : "; ") + result.image->reason;
  if (!result.message.empty())
    PM_TRY_STATUS(keep_failure(suite, settings, rendered, &*reference, *result.image, maps));
  PM_TRY_STATUS(fill_report(suite, settings, actual, &*reference, maps, result));
  return result;
}

/// CHANGES.md as it is; one that cannot be read is not begun anew.
Result<std::string> changes_of(const GoldenSuite& suite) {
  const fs::path file = suite.folder / "CHANGES.md";
  std::error_code ignored;
  if (fs::exists(file, ignored)) return read_file(file);
  return fmt::format("# Changes to the golden frames of {}\n", suite.name);
}

}  // namespace

std::size_t GoldenResult::failed() const {
  return static_cast<std::size_t>(std::count_if(frames.begin(), frames.end(),
                                                [](const GoldenFrame& f) { return !f.passed(); }));
}

Result<GoldenResult> test_golden(const GoldenSuite& suite, const GoldenSettings& settings) {
  PM_TRY(SuiteRenderer renderer, SuiteRenderer::create(suite, settings));
  PM_TRY(const std::vector<SurfaceRecord> records, read_records(suite));
  GoldenResult result{suite.name, {}, find_orphans(suite)};
  for (const int frame : suite.frames) {
    const Stopwatch stopwatch;
    forget_failure(suite, settings, frame);
    PM_TRY(const RenderedFrame rendered, renderer.render(frame));
    PM_TRY(GoldenFrame judged, judge(suite, settings, records, rendered));
    judged.report.seconds = stopwatch.seconds();
    result.frames.push_back(std::move(judged));
  }
  return result;
}

Result<std::vector<fs::path>> update_golden(const GoldenSuite& suite,
                                            const GoldenSettings& settings,
                                            const std::string& reason) {
  if (const char* ci = std::getenv("CI");
      ci && *ci && std::string_view(ci) != "false" && std::string_view(ci) != "0")
    return make_error(
        ErrorCode::kUsage,
        "golden update writes references and never runs under CI (CI={}) - run it by hand", ci);
  if (reason.empty())
    return make_error(ErrorCode::kUsage, "golden update needs --reason \"why the frames changed\"");
  PM_TRY(SuiteRenderer renderer, SuiteRenderer::create(suite, settings));
  // Damaged ones are written anew.
  const auto readable = read_records(suite);
  const std::vector<SurfaceRecord> old_records =
      readable ? *readable : std::vector<SurfaceRecord>{};
  GoldenSettings quiet = settings;
  quiet.failures.clear();
  std::vector<SurfaceRecord> records;
  std::vector<NewFile> files;
  bool surface_changed = old_records.size() != suite.frames.size();
  for (const int frame : suite.frames) {
    PM_TRY(const RenderedFrame rendered, renderer.render(frame));
    if (!all_finite(rendered.image))
      return make_error(ErrorCode::kInternal,
                        "frame {} of {} has NaN or infinite pixels - it cannot become a golden",
                        frame, suite.name);
    PM_TRY(const GoldenFrame judged, judge(suite, quiet, old_records, rendered));
    records.push_back(rendered.surface);
    surface_changed |= !judged.surface_passed;
    if (judged.passed()) continue;
    PM_TRY(std::string encoded, encode_exr(rendered.image));
    files.push_back({golden_image_path(suite, frame), std::move(encoded)});
  }
  const std::size_t frames = files.size();
  if (surface_changed)
    files.push_back({suite.folder / "surface.csv", surface_records_text(records)});
  std::vector<fs::path> written;
  for (const NewFile& file : files) written.push_back(file.path);
  if (files.empty()) return written;
  PM_TRY(std::string changes, changes_of(suite));
  changes += fmt::format("\n- polymorph {}, {} frame{}: {}\n", PM_VERSION, frames,
                         frames == 1 ? "" : "s", reason);
  files.push_back({suite.folder / "CHANGES.md", std::move(changes)});
  PM_TRY_STATUS(write_files(files));
  return written;
}

}  // namespace polymorph
