#include "golden/golden_accept.h"

#include <algorithm>
#include <map>

#include "base/archive.h"
#include "base/file.h"
#include "base/frames.h"
#include "base/json.h"
#include "base/program_identity.h"
#include "base/sha256.h"
#include "base/text.h"
#include "golden/golden_frames.h"
#include "golden/golden_write.h"
#include "image/image_io.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;
using Files = std::map<std::string, std::string>;  ///< contents by path in the report

/// Tests whether the last components of a path are those of `name`.
bool ends_in_path(const std::string& path, const std::string& name) {
  return path == name || path.ends_with("/" + name);
}

/// A failed frame in a report.
struct FailedFrame {
  SurfaceRecord surface;
  std::string sha256;  ///< hash of its file
};

/// The contents of a report.json that accept_report() uses.
struct ParsedReport {
  std::string program;  ///< program_identity() of the build that made it
  std::map<std::string, std::string> suite_hashes;         ///< suite_hash() by the suite's name
  std::map<std::string, std::vector<FailedFrame>> failed;  ///< failed frames by the suite's name
};

/// Parses the text of a report.json. Messages name `report`. Errors: kInput.
Result<ParsedReport> parse_report(const fs::path& report, const std::string& text) {
  const auto document = parse_json("report.json", text);
  const auto refuse = [&](const std::string& why) {
    return make_error(ErrorCode::kInput,
                      "{}: its report.json was not written by 'golden test --report': {}",
                      report.string(), why);
  };
  if (!document) return refuse(document.error().message);
  const JsonValue& json = document->root;
  for (const char* key : {"facts", "suites", "cases"})
    if (!json.contains(key)) return refuse(fmt::format("it has no \"{}\"", key));
  ParsedReport parsed;
  parsed.program = json.get("facts").get("program").string;
  for (const JsonMember& suite : json.get("suites").members)
    parsed.suite_hashes[suite.key] = suite.value.string;
  for (const JsonValue& golden_case : json.get("cases").items) {
    // A failed case without file_sha256 has no file to accept.
    if (golden_case.get("passed").boolean || !golden_case.contains("file_sha256")) continue;
    const JsonValue& surface = golden_case.get("surface");
    if (!golden_case.get("frame").integral || !surface.get("vertices").integral ||
        !surface.get("triangles").integral)
      return refuse("a failed case has no frame or no surface");
    FailedFrame failed;
    failed.sha256 = golden_case.get("file_sha256").string;
    failed.surface.frame = static_cast<int>(golden_case.get("frame").integer);
    failed.surface.vertices = static_cast<std::size_t>(surface.get("vertices").integer);
    failed.surface.triangles = static_cast<std::size_t>(surface.get("triangles").integer);
    failed.surface.digest = surface.get("digest").string;
    parsed.failed[golden_case.get("group").string].push_back(std::move(failed));
  }
  return parsed;
}

/// Returns the text of the report.json with the shortest path, which is in the outermost folder.
/// Errors: kInput if there is none.
Result<std::string> find_report_json(const fs::path& report, const Files& files) {
  const std::string* report_text = nullptr;
  std::size_t shortest_path = 0;
  for (const auto& [name, bytes] : files)
    if (ends_in_path(name, "report.json") && (!report_text || name.size() < shortest_path)) {
      report_text = &bytes;
      shortest_path = name.size();
    }
  if (!report_text)
    return make_error(ErrorCode::kInput,
                      "{}: no report.json in it - give what 'golden test --report' left",
                      report.string());
  return *report_text;
}

/// Finds the file of a failed frame, checks its hash and pixels, and returns it as a golden.
/// Errors: kInput.
Result<NewGolden> read_golden(const fs::path& report, const Files& files, const GoldenSuite& suite,
                              const FailedFrame& failed) {
  const std::string path =
      fmt::format("{}/frame.{:04}.actual.{}", suite.name, failed.surface.frame, suite.format);
  const auto file = std::find_if(files.begin(), files.end(), [&](const auto& entry) {
    return ends_in_path(entry.first, path);
  });
  if (file == files.end())
    return make_error(ErrorCode::kInput,
                      "{}: no {} in it - let the CI keep the folder of --failures inside the "
                      "report, as scripts/ci/golden does",
                      report.string(), path);
  const std::string& bytes = file->second;
  if (Sha256().add(bytes.data(), bytes.size()).hex() != failed.sha256)
    return make_error(ErrorCode::kInput, "{}: {} is not the file that the run wrote",
                      report.string(), file->first);
  PM_TRY(const Image image, decode_image(bytes, file->first, {.single_picture = true}));
  if (!all_finite(image))
    return make_error(ErrorCode::kInput,
                      "{}: {} has NaN or infinite pixels - it cannot become a golden",
                      report.string(), file->first);
  return NewGolden{failed.surface, bytes};
}

/// Checks that this build made the report (unless `any_program`), from the files of the suite's
/// scene as they are now. Errors: kInput.
Status check_origin(const fs::path& report, const ParsedReport& parsed, const GoldenSuite& suite,
                    bool any_program) {
  if (!any_program && parsed.program != program_identity())
    return make_error(ErrorCode::kInput,
                      "{}: made by another program ({}) than this one ({}) - build that commit, or "
                      "say --any-program",
                      report.string(), printable(parsed.program), program_identity());
  const auto hash = parsed.suite_hashes.find(suite.name);
  PM_TRY(const std::string present_hash, suite_hash(suite));
  if (hash == parsed.suite_hashes.end() || hash->second != present_hash)
    return make_error(
        ErrorCode::kInput,
        "{}: its {} was rendered from another scene, model or texture than yours - check out the "
        "commit that was tested",
        report.string(), suite.name);
  return Ok{};
}

}  // namespace

Result<std::vector<fs::path>> accept_report(const fs::path& report,
                                            const AcceptSettings& settings) {
  PM_TRY_STATUS(check_write_allowed("accept", settings.reason));
  PM_TRY(const Files files, read_tree(report, [](const std::string& name) {
           return ends_in_path(name, "report.json") || name.find(".actual.") != std::string::npos;
         }));
  PM_TRY(const std::string text, find_report_json(report, files));
  PM_TRY(const ParsedReport parsed, parse_report(report, text));
  for (const std::string& name : settings.suites)
    if (!parsed.failed.contains(name))
      return make_error(ErrorCode::kInput, "{}: no frame of {} failed in it", report.string(),
                        printable(name));
  // Check and collect the chosen frames of every suite, then write all of them or none.
  std::vector<NewFile> files_to_write;
  std::vector<fs::path> paths;
  std::size_t chosen_count = 0;
  for (const auto& [name, failed_frames] : parsed.failed) {
    if (!settings.suites.empty() &&
        std::find(settings.suites.begin(), settings.suites.end(), name) == settings.suites.end())
      continue;
    PM_TRY(const GoldenSuite suite, load_golden_suite(settings.root, name));
    PM_TRY_STATUS(check_origin(report, parsed, suite, settings.any_program));
    std::vector<int> frames;
    if (!settings.frames.empty()) {
      // Any number may be chosen here; one without a failed frame chooses nothing. Whether the
      // suite has the failed frames is checked below.
      PM_TRY(frames, parse_frames(settings.frames, /*first=*/0, /*last=*/9999999));
    }
    std::vector<NewGolden> goldens;
    for (const FailedFrame& failed : failed_frames) {
      const int frame = failed.surface.frame;
      if (!frames.empty() && std::find(frames.begin(), frames.end(), frame) == frames.end())
        continue;
      if (std::find(suite.frames.begin(), suite.frames.end(), frame) == suite.frames.end())
        return make_error(ErrorCode::kInput, "{}: {} has no frame {}",
                          (suite.folder / "suite.json").string(), suite.name, frame);
      PM_TRY(NewGolden golden, read_golden(report, files, suite, failed));
      goldens.push_back(std::move(golden));
    }
    chosen_count += goldens.size();
    PM_TRY(std::vector<NewFile> suite_files, make_golden_files(suite, goldens, settings.reason));
    for (NewFile& file : suite_files) {
      paths.push_back(file.path);
      files_to_write.push_back(std::move(file));
    }
  }
  if (chosen_count == 0)
    return make_error(ErrorCode::kInput, "{}: no failed frame in it to accept{}", report.string(),
                      settings.frames.empty() ? "" : " among " + settings.frames);
  PM_TRY_STATUS(write_files(files_to_write));
  return paths;
}

}  // namespace polymorph
