#include "golden/golden_write.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string_view>

#include "base/file.h"
#include "base/plural.h"
#include "base/program_identity.h"
#include "base/text.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Reads CHANGES.md, or returns its title if there is no such file. Errors: kInput.
Result<std::string> read_changes(const GoldenSuite& suite) {
  const fs::path file = suite.folder / "CHANGES.md";
  std::error_code ignored;
  if (fs::exists(file, ignored)) return read_file(file);
  return fmt::format("# Changes to the golden frames of {}\n", suite.name);
}

/// Appends an entry to the text of CHANGES.md; `image_count` is the number of changed images. If
/// the last entry has the same reason, the new one replaces it, with the larger of the two counts.
std::string add_entry(std::string text, std::size_t image_count, const std::string& reason) {
  const auto last = text.rfind("\n- ");
  if (last != std::string::npos) {
    const std::string entry = text.substr(last + 1);
    if (entry.ends_with(fmt::format(": {}\n", reason))) {
      // The number after the comma of "- polymorph VERSION, N frames: REASON".
      const auto comma = entry.find(", ");
      const auto old_count =
          parse_integer(entry.substr(comma + 2, entry.find(' ', comma + 2) - comma - 2));
      image_count = std::max(
          image_count, static_cast<std::size_t>(std::max<std::int64_t>(0, old_count.value_or(0))));
      text.resize(last);
    }
  }
  return text + fmt::format("\n- polymorph {}, {}: {}\n", program_version(),
                            plural(image_count, "frame"), reason);
}

}  // namespace

Status check_write_allowed(const std::string& verb, const std::string& reason) {
  if (const char* ci = std::getenv("CI");
      ci && *ci && std::string_view(ci) != "false" && std::string_view(ci) != "0")
    return make_error(
        ErrorCode::kUsage,
        "golden {} writes references and never runs under CI (CI={}) - run it by hand", verb, ci);
  if (reason.empty() || reason.find('\n') != std::string::npos)
    return make_error(ErrorCode::kUsage,
                      "golden {} needs --reason \"why the frames changed\", on one line", verb);
  return Ok{};
}

bool all_finite(const Image& image) {
  return std::all_of(image.pixels.begin(), image.pixels.end(),
                     [](float v) { return std::isfinite(v); });
}

Result<std::vector<NewFile>> make_golden_files(const GoldenSuite& suite,
                                               const std::vector<NewGolden>& frames,
                                               const std::string& reason) {
  std::vector<NewFile> files;
  for (const NewGolden& golden : frames)
    if (!golden.bytes.empty())
      files.push_back({golden_image_path(suite, golden.surface.frame), golden.bytes});
  const std::size_t image_count = files.size();
  if (suite.command.empty()) {
    // Keep the rows of the suite's other frames, but drop rows of frames that the suite no longer
    // has. If surface.csv is missing or damaged, it is written anew.
    const auto old_records = read_surface_records(suite.folder / "surface.csv");
    std::map<int, SurfaceRecord> rows;
    if (old_records)
      for (const SurfaceRecord& record : *old_records)
        if (std::find(suite.frames.begin(), suite.frames.end(), record.frame) != suite.frames.end())
          rows[record.frame] = record;
    for (const NewGolden& golden : frames) rows[golden.surface.frame] = golden.surface;
    std::vector<SurfaceRecord> records;
    for (const auto& [frame, record] : rows) records.push_back(record);
    const std::string text = surface_records_text(records);
    if (!old_records || surface_records_text(*old_records) != text)
      files.push_back({suite.folder / "surface.csv", text});
  }
  if (files.empty()) return files;
  PM_TRY(std::string changes, read_changes(suite));
  files.push_back(
      {suite.folder / "CHANGES.md", add_entry(std::move(changes), image_count, reason)});
  return files;
}

}  // namespace polymorph
