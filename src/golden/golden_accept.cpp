#include "golden/golden_accept.h"

#include <algorithm>
#include <map>

#include "base/archive.h"
#include "base/file.h"
#include "base/json.h"
#include "base/program_identity.h"
#include "base/sha256.h"
#include "base/text.h"
#include "golden/golden_frames.h"
#include "golden/golden_write.h"
#include "image/image_io.h"
#include "sequence/run/frames.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;
using Files = std::map<std::string, std::string>;

bool ends_in_path(const std::string& path, const std::string& name) {
  return path == name || path.ends_with("/" + name);
}

/// A failed frame in a report.
struct Failed {
  SurfaceRecord surface;
  std::string sha256;  ///< hash of its file
};

struct ParsedReport {
  std::string program;
  std::map<std::string, std::string> suite_hashes;
  std::map<std::string, std::vector<Failed>> failed;  ///< keyed by suite
};

Result<ParsedReport> parse_report(const fs::path& report, const std::string& text) {
  const auto document = parse_json("report.json", text);
  const auto refuse = [&](const std::string& why) {
    return make_error(ErrorCode::kInput,
                      "{}: its report.json is not one of 'golden test --report': {}",
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
  for (const JsonValue& one : json.get("cases").items) {
    if (one.get("passed").boolean || !one.contains("file_sha256")) continue;
    const JsonValue& surface = one.get("surface");
    if (!one.get("frame").integral || !surface.get("vertices").integral ||
        !surface.get("triangles").integral)
      return refuse("a failed case has no frame or no surface");
    Failed failed;
    failed.sha256 = one.get("file_sha256").string;
    failed.surface.frame = static_cast<int>(one.get("frame").integer);
    failed.surface.vertices = static_cast<std::size_t>(surface.get("vertices").integer);
    failed.surface.triangles = static_cast<std::size_t>(surface.get("triangles").integer);
    failed.surface.digest = surface.get("digest").string;
    parsed.failed[one.get("group").string].push_back(std::move(failed));
  }
  return parsed;
}

/// The report that lies highest.
Result<std::string> find_report_json(const fs::path& report, const Files& files) {
  const std::string* best = nullptr;
  std::size_t shortest = 0;
  for (const auto& [name, bytes] : files)
    if (ends_in_path(name, "report.json") && (!best || name.size() < shortest)) {
      best = &bytes;
      shortest = name.size();
    }
  if (!best)
    return make_error(ErrorCode::kInput,
                      "{}: no report.json in it - give what 'golden test --report' left",
                      report.string());
  return *best;
}

/// One frame of the report as a golden.
Result<NewGolden> read_golden(const fs::path& report, const Files& files, const GoldenSuite& suite,
                              const Failed& failed) {
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

Status check_origin(const fs::path& report, const ParsedReport& parsed, const GoldenSuite& suite,
                    bool any_program) {
  if (!any_program && parsed.program != program_identity())
    return make_error(ErrorCode::kInput,
                      "{}: made by another program ({}) than this one ({}) - build that commit, or "
                      "say --any-program",
                      report.string(), printable(parsed.program), program_identity());
  const auto hash = parsed.suite_hashes.find(suite.name);
  PM_TRY(const std::string own, suite_hash(suite));
  if (hash == parsed.suite_hashes.end() || hash->second != own)
    return make_error(ErrorCode::kInput,
                      "{}: its {} is of another scene, model or texture than yours - check out the "
                      "commit that was tested",
                      report.string(), suite.name);
  return Ok{};
}

}  // namespace

Result<std::vector<fs::path>> accept_report(const fs::path& report,
                                            const AcceptSettings& settings) {
  PM_TRY_STATUS(may_write_goldens("accept", settings.reason));
  PM_TRY(const Files files, read_tree(report, [](const std::string& name) {
           return ends_in_path(name, "report.json") || name.find(".actual.") != std::string::npos;
         }));
  PM_TRY(const std::string text, find_report_json(report, files));
  PM_TRY(const ParsedReport parsed, parse_report(report, text));
  for (const std::string& name : settings.suites)
    if (!parsed.failed.contains(name))
      return make_error(ErrorCode::kInput, "{}: no frame of {} failed in it", report.string(),
                        printable(name));
  std::vector<NewFile> write;
  std::vector<fs::path> written;
  std::size_t chosen = 0;
  for (const auto& [name, all] : parsed.failed) {
    if (!settings.suites.empty() &&
        std::find(settings.suites.begin(), settings.suites.end(), name) == settings.suites.end())
      continue;
    PM_TRY(const GoldenSuite suite, load_golden_suite(settings.root, name));
    PM_TRY_STATUS(check_origin(report, parsed, suite, settings.any_program));
    std::vector<int> only;
    if (!settings.frames.empty()) {
      PM_TRY(only, parse_frames(settings.frames, 0, 9999999));
    }
    std::vector<NewGolden> goldens;
    for (const Failed& failed : all) {
      const int frame = failed.surface.frame;
      if (!only.empty() && std::find(only.begin(), only.end(), frame) == only.end()) continue;
      if (std::find(suite.frames.begin(), suite.frames.end(), frame) == suite.frames.end())
        return make_error(ErrorCode::kInput, "{}: {} has no frame {}",
                          (suite.folder / "suite.json").string(), suite.name, frame);
      PM_TRY(NewGolden golden, read_golden(report, files, suite, failed));
      goldens.push_back(std::move(golden));
    }
    chosen += goldens.size();
    PM_TRY(std::vector<NewFile> more, golden_files(suite, goldens, settings.reason));
    for (NewFile& file : more) {
      written.push_back(file.path);
      write.push_back(std::move(file));
    }
  }
  if (chosen == 0)
    return make_error(ErrorCode::kInput, "{}: no failed frame in it to accept{}", report.string(),
                      settings.frames.empty() ? "" : " among " + settings.frames);
  PM_TRY_STATUS(write_files(write));
  return written;
}

}  // namespace polymorph
