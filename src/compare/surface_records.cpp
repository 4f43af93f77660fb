#include "base/file.h"
#include "base/text.h"
#include "compare/golden.h"

namespace polymorph {
namespace {

constexpr const char* kHeader = "frame,vertices,triangles,digest";

/// Tests for hexadecimal digits in lower case.
bool is_digest(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

}  // namespace

Result<std::vector<SurfaceRecord>> read_surface_records(const std::filesystem::path& csv) {
  PM_TRY(const std::string text, read_file(csv, 64 << 20));  // at most 64 MiB
  std::vector<std::string> lines = split(text, '\n');
  for (std::string& line : lines)
    if (line.ends_with('\r')) line.pop_back();
  while (!lines.empty() && lines.back().empty()) lines.pop_back();
  if (lines.empty() || lines[0] != kHeader)
    return make_error(ErrorCode::kInput, "{}:1: the first line must be '{}'", csv.string(),
                      kHeader);
  std::vector<SurfaceRecord> records;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::vector<std::string> fields = split(lines[i], ',');
    // Parses a field; -1 if it is missing or no integer.
    const auto number = [&](std::size_t field) {
      return field < fields.size() ? parse_integer(fields[field]).value_or(-1) : -1;
    };
    if (fields.size() != 4 || number(0) < 0 || number(0) > 9999999 || number(1) < 0 ||
        number(2) < 0 || !is_digest(fields[3]))
      return make_error(
          ErrorCode::kInput,
          "{}:{}: '{}' is not FRAME,VERTICES,TRIANGLES,DIGEST - update the suite to write it anew",
          csv.string(), i + 1, lines[i]);
    const SurfaceRecord record{static_cast<int>(number(0)), static_cast<std::size_t>(number(1)),
                               static_cast<std::size_t>(number(2)), fields[3]};
    if (!records.empty() && record.frame <= records.back().frame)
      return make_error(ErrorCode::kInput,
                        "{}:{}: frame {} does not follow frame {} - frames must rise", csv.string(),
                        i + 1, record.frame, records.back().frame);
    records.push_back(record);
  }
  return records;
}

std::string surface_records_text(const std::vector<SurfaceRecord>& records) {
  std::string text = fmt::format("{}\n", kHeader);
  for (const SurfaceRecord& record : records)
    text += fmt::format("{},{},{},{}\n", record.frame, record.vertices, record.triangles,
                        record.digest);
  return text;
}

}  // namespace polymorph
