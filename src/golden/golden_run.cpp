#include "golden/golden_run.h"

#include <algorithm>

#include "base/file.h"
#include "base/sha256.h"
#include "base/stopwatch.h"
#include "compare/pictures.h"
#include "film/render_sequence.h"
#include "golden/golden_frames.h"
#include "golden/golden_masks.h"
#include "golden/golden_write.h"
#include "image/image_io.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Reads the suite's surface.csv. Returns no records if there is no such file. Errors: kInput.
Result<std::vector<SurfaceRecord>> read_records(const GoldenSuite& suite) {
  const fs::path file = suite.folder / "surface.csv";
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::vector<SurfaceRecord>{};
  return read_surface_records(file);
}

/// Returns a message if the surface differs from the record of its frame, or has none; else "".
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

/// Returns FAILURES/SUITE/frame.####.SUFFIX.
fs::path failure_path(const GoldenSuite& suite, const GoldenSettings& settings, int frame,
                      const char* suffix) {
  return settings.failures / suite.name / fmt::format("frame.{:04d}.{}", frame, suffix);
}

/// Returns the path at which a failing frame is written. accept_report() may make it the golden.
fs::path actual_path(const GoldenSuite& suite, const GoldenSettings& settings, int frame) {
  return failure_path(suite, settings, frame, ("actual." + suite.format).c_str());
}

/// Removes the files of an earlier failure of the frame, which may pass now.
void remove_failure(const GoldenSuite& suite, const GoldenSettings& settings, int frame) {
  if (settings.failures.empty()) return;
  std::error_code ignored;
  fs::remove(actual_path(suite, settings, frame), ignored);
  for (const char* suffix : {"reference.exr", "difference.png"})
    fs::remove(failure_path(suite, settings, frame, suffix), ignored);
}

/// A rendered frame and the golden that it is compared with.
struct FrameTest {
  const GoldenSuite& suite;
  const GoldenSettings& settings;
  const RenderedFrame& rendered;
  const Image* reference = nullptr;  ///< null: missing or unreadable
  Image actual = {};                 ///< the frame after replace_masked_pixels()
  PixelMaps maps = {};
};

/// Writes the actual frame of a failure and, if there is a reference, also the reference and the
/// difference. Writes nothing without a folder for failures.
Status write_failure(const FrameTest& test, const Comparison& comparison) {
  const GoldenSuite& suite = test.suite;
  const GoldenSettings& settings = test.settings;
  const RenderedFrame& rendered = test.rendered;
  if (settings.failures.empty()) return Ok{};
  const auto path = [&](const char* suffix) {
    return failure_path(suite, settings, rendered.surface.frame, suffix);
  };
  PM_TRY_STATUS(write_file(actual_path(suite, settings, rendered.surface.frame), rendered.bytes));
  if (const Image* reference = test.reference) {
    Image rec709_reference = *reference;
    convert_to_rec709(rec709_reference);  // the colour space of all files that the program writes
    PM_TRY_STATUS(write_image(path("reference.exr"), rec709_reference));
    PM_TRY(const Image difference,
           failure_picture(rendered.image, *reference, comparison, test.maps));
    PM_TRY_STATUS(write_image(path("difference.png"), difference));
  }
  return Ok{};
}

/// Tests whether a file has the name of one of the masks' pictures.
bool is_mask(const GoldenSuite& suite, const fs::path& file) {
  return std::any_of(suite.masks.begin(), suite.masks.end(), [&](const GoldenMask& mask) {
    return mask.file.filename() == file.filename();
  });
}

/// Finds the images in the suite's folder that are neither goldens nor masks, sorted by name.
std::vector<fs::path> find_orphans(const GoldenSuite& suite) {
  std::vector<fs::path> orphans;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(suite.folder, error)) {
    if (entry.path().extension() != "." + suite.format) continue;
    if (is_mask(suite, entry.path())) continue;
    const bool is_golden = std::any_of(suite.frames.begin(), suite.frames.end(), [&](int frame) {
      return golden_image_path(suite, frame).filename() == entry.path().filename();
    });
    if (!is_golden) orphans.push_back(entry.path());
  }
  std::sort(orphans.begin(), orphans.end());
  return orphans;
}

/// Fills in the frame's case of the report, and adds its pictures.
Status fill_report(const FrameTest& test, GoldenFrame& result) {
  const auto& [suite, settings, rendered, reference, actual, maps] = test;
  ReportCase& report = result.report;
  report.group = suite.name;
  report.name = fmt::format("frame {}", result.frame);
  report.reference = golden_image_path(suite, result.frame);
  report.tolerance = suite.tolerance;
  report.message = result.message;
  report.error = result.unreadable;
  report.comparison = result.image;
  if (!result.passed() && !settings.failures.empty()) {
    report.actual = actual_path(suite, settings, result.frame);
    report.file_sha256 = Sha256().add(rendered.bytes.data(), rendered.bytes.size()).hex();
  }
  if (!settings.pictures) return Ok{};
  return add_pictures(report, actual, reference, maps, *settings.pictures);
}

/// Writes and reports a frame that fails because its golden is missing or unreadable.
Status report_uncompared(const FrameTest& test, GoldenFrame& result) {
  PM_TRY_STATUS(write_failure(test, /*comparison=*/{}));
  return fill_report(test, result);
}

/// Returns an error message if the masks cover more than the suite allows, because large masks
/// could let everything pass; else "".
std::string check_masked_percent(const GoldenSuite& suite, double percent) {
  if (percent <= suite.max_masked_percent) return "";
  return fmt::format("{:.3g} % of the pixels are masked, suite.json allows {:.3g} %", percent,
                     suite.max_masked_percent);
}

/// Explains the change of a frame in words (explain_change()).
std::string explain_failure(const RenderedFrame& rendered, const Image& reference,
                            const GoldenFrame& result) {
  ChangeContext context = rendered.context;
  context.surfaces_known = !rendered.surface.digest.empty();
  context.surfaces_equal = result.surface_passed;
  return explain_change(rendered.image, reference, context);
}

/// Compares one frame with its golden: first the surface with its record, then the pixels outside
/// the masks. Writes the files of a failure, and fills in the case of the report.
Result<GoldenFrame> test_frame(const GoldenSuite& suite, const GoldenSettings& settings,
                               const std::vector<SurfaceRecord>& records,
                               const RenderedFrame& rendered) {
  // Compare the surface.
  GoldenFrame result;
  result.frame = rendered.surface.frame;
  if (suite.command.empty()) result.message = compare_surface(rendered.surface, records);
  result.surface_passed = result.message.empty();
  result.report.surface = rendered.surface;
  result.report.pixels_sha256 = rendered.pixel_hash;
  // Read the golden image.
  FrameTest test{suite, settings, rendered, /*reference=*/nullptr, rendered.image};
  const fs::path golden = golden_image_path(suite, result.frame);
  if (!fs::exists(golden)) {
    result.message = golden.string() + " is missing";  // ReportCase::accept says what to do
    PM_TRY_STATUS(report_uncompared(test, result));
    return result;
  }
  const auto reference = read_image(golden, {.single_picture = true, .stored_colors = true});
  if (!reference) {
    result.unreadable = true;
    result.message = reference.error().message;
    PM_TRY_STATUS(report_uncompared(test, result));
    return result;
  }
  // Compare the images, and explain and write a failure.
  test.reference = &*reference;
  PM_TRY(result.masked_percent, replace_masked_pixels(suite, *reference, test.actual));
  result.image = compare_images(test.actual, *reference, suite.tolerance, &test.maps);
  if (!suite.masks.empty()) result.report.masked_percent = result.masked_percent;
  result.report.max_masked_percent = suite.max_masked_percent;
  for (const std::string& reason : {result.image->passed() ? "" : result.image->reason,
                                    check_masked_percent(suite, result.masked_percent)})
    if (!reason.empty()) result.message += (result.message.empty() ? "" : "; ") + reason;
  // The percentage of masked pixels is not added to result.message: the line that is printed for
  // the frame states it anyway.
  if (result.masked_percent > 0)
    result.image->reason += fmt::format("; {:.3g} % masked", result.masked_percent);
  if (!result.message.empty()) {
    result.report.cause = explain_failure(rendered, *reference, result);
    PM_TRY_STATUS(write_failure(test, *result.image));
  }
  PM_TRY_STATUS(fill_report(test, result));
  return result;
}

/// Renders all frames of a suite and returns the files that must be written to make them its
/// goldens. The images of frames that pass are not among them.
Result<std::vector<NewFile>> render_goldens(const GoldenSuite& suite,
                                            const GoldenSettings& settings,
                                            const std::string& reason) {
  PM_TRY(SuiteRenderer renderer, SuiteRenderer::create(suite, settings));
  // A damaged surface.csv counts as empty, so that it is written anew.
  const auto stored = read_records(suite);
  const std::vector<SurfaceRecord> old_records = stored ? *stored : std::vector<SurfaceRecord>{};
  GoldenSettings update_settings = settings;
  update_settings.failures.clear();  // test_frame() must not write files
  std::vector<NewGolden> frames;
  for (const int frame : suite.frames) {
    PM_TRY(RenderedFrame rendered, renderer.render(frame));
    if (!all_finite(rendered.image))
      return make_error(suite.command.empty() ? ErrorCode::kInternal : ErrorCode::kInput,
                        "frame {} of {} has NaN or infinite pixels - it cannot become a golden",
                        frame, suite.name);
    PM_TRY(const GoldenFrame result, test_frame(suite, update_settings, old_records, rendered));
    frames.push_back({rendered.surface, result.passed() ? "" : std::move(rendered.bytes)});
  }
  return make_golden_files(suite, frames, reason);
}

/// Writes the files, all or nothing, and returns their paths.
Result<std::vector<fs::path>> write_and_list(const std::vector<NewFile>& files) {
  PM_TRY_STATUS(write_files(files));
  std::vector<fs::path> written;
  for (const NewFile& file : files) written.push_back(file.path);
  return written;
}

}  // namespace

std::size_t GoldenResult::failed() const {
  return static_cast<std::size_t>(std::count_if(frames.begin(), frames.end(),
                                                [](const GoldenFrame& f) { return !f.passed(); }));
}

Result<GoldenResult> test_golden(const GoldenSuite& suite, const GoldenSettings& settings) {
  PM_TRY(SuiteRenderer renderer, SuiteRenderer::create(suite, settings));
  PM_TRY(const std::vector<SurfaceRecord> records, read_records(suite));
  GoldenResult result{/*frames=*/{}, find_orphans(suite)};
  for (const int frame : suite.frames) {
    const Stopwatch stopwatch;
    remove_failure(suite, settings, frame);
    PM_TRY(const RenderedFrame rendered, renderer.render(frame));
    PM_TRY(GoldenFrame frame_result, test_frame(suite, settings, records, rendered));
    frame_result.report.seconds = stopwatch.seconds();
    result.frames.push_back(std::move(frame_result));
  }
  return result;
}

Result<std::vector<fs::path>> update_golden(const GoldenSuite& suite,
                                            const GoldenSettings& settings,
                                            const std::string& reason) {
  PM_TRY_STATUS(check_write_allowed("update", reason));
  PM_TRY(const std::vector<NewFile> files, render_goldens(suite, settings, reason));
  return write_and_list(files);
}

Result<std::vector<fs::path>> create_golden_suite(GoldenSuite suite, const GoldenSettings& settings,
                                                  const std::string& reason) {
  PM_TRY_STATUS(check_write_allowed("new", reason));
  std::error_code ignored;
  if (fs::symlink_status(suite.folder, ignored).type() != fs::file_type::not_found)
    return make_error(ErrorCode::kOutput, "{}: exists - choose another name",
                      suite.folder.string());
  suite.tolerance = zero_tolerance();
  PM_TRY(std::vector<NewFile> files, render_goldens(suite, settings, reason));
  files.insert(files.begin(), {suite.folder / "suite.json", suite_json_text(suite)});
  return write_and_list(files);
}

Result<std::vector<FrameHash>> hash_golden(GoldenSuite suite, const GoldenSettings& settings) {
  PM_TRY(SuiteRenderer renderer, SuiteRenderer::create(suite, settings));
  if (suite.frames.empty()) {
    const int count = renderer.frame_count();
    suite.frames = {1};
    if (count > 2) suite.frames.push_back((count + 1) / 2);
    if (count > 1) suite.frames.push_back(count);
  }
  std::vector<FrameHash> hashes;
  for (const int frame : suite.frames) {
    PM_TRY(std::string sha256, renderer.hash(frame));
    hashes.push_back({frame, std::move(sha256)});
  }
  return hashes;
}

}  // namespace polymorph
