#include "compare/report_merge.h"

#include <map>
#include <optional>
#include <set>

#include "base/archive.h"
#include "base/file.h"
#include "base/folder.h"
#include "base/json.h"
#include "base/text.h"
#include "compare/comparison_report.h"
#include "compare/format_error.h"
#include "compare/report_data.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDataBegin = "<script type=\"application/json\" id=\"data\">";
constexpr const char* kDataEnd = "</script>";

/// Returns a member of an object. Throws FormatError if it is missing or of another kind.
const JsonValue& member(const JsonValue& object, const char* key, JsonValue::Kind kind) {
  const JsonValue& value = object.get(key);
  if (value.kind != kind)
    throw FormatError(
        fmt::format("\"{}\" must be {} (is {})", key, kind_name(kind), kind_name(value.kind)));
  return value;
}
const std::string& text_at(const JsonValue& object, const char* key) {
  return member(object, key, JsonValue::Kind::kString).string;
}
bool flag_at(const JsonValue& object, const char* key) {
  return member(object, key, JsonValue::Kind::kBoolean).boolean;
}
std::size_t count_at(const JsonValue& object, const char* key) {
  return static_cast<std::size_t>(member(object, key, JsonValue::Kind::kNumber).integer);
}
const std::vector<JsonValue>& list_at(const JsonValue& object, const char* key) {
  return member(object, key, JsonValue::Kind::kArray).items;
}

/// One report, read and checked.
struct Shard {
  JsonValue report;                          ///< report.json
  JsonValue page;                            ///< the JSON in index.html
  std::string junit;                         ///< the <testsuite> elements of junit.xml
  std::map<std::string, std::string> files;  ///< pictures and kept frames, by path in the report
};

struct CaseCounts {
  std::size_t all = 0, failed = 0, errors = 0;
  bool operator==(const CaseCounts&) const = default;
};

CaseCounts count_cases(const JsonValue& cases) {
  CaseCounts counts;
  for (const JsonValue& entry : cases.items) {
    ++counts.all;
    counts.failed += !flag_at(entry, "passed");
    counts.errors += text_at(entry, "verdict") == "error";
  }
  return counts;
}

std::size_t count_occurrences(const std::string& text, const std::string& pattern) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(pattern, at)) != std::string::npos; at += pattern.size())
    ++count;
  return count;
}

Result<JsonValue> parse_report(const fs::path& file, const std::string& text) {
  auto document = parse_json(file.string(), text);
  if (!document || !document->root.get("cases").is_array())
    return make_error(ErrorCode::kInput, "{}: not a report of polymorph", file.string());
  return std::move(document->root);
}

/// Returns the text between the first `begin` and the next `end`. `file` names it in the error.
Result<std::string> extract_between(const fs::path& file, const std::string& text,
                                    const std::string& begin, const std::string& end) {
  const auto from = text.find(begin);
  const auto to = from == std::string::npos ? from : text.find(end, from + begin.size());
  if (to == std::string::npos)
    return make_error(ErrorCode::kInput, "{}: not of a report of polymorph", file.string());
  return text.substr(from + begin.size(), to - from - begin.size());
}

std::string case_name(const JsonValue& entry) {
  return text_at(entry, "group") + ", " + text_at(entry, "name");
}

/// Describes a contradiction within a case, or returns "". A case passed if it has no message; then
/// its verdict and its metrics must have passed, too.
std::string find_contradiction(const JsonValue& entry) {
  const std::string& verdict = text_at(entry, "verdict");
  const bool passed = flag_at(entry, "passed");
  if (passed != text_at(entry, "message").empty())
    return passed ? "passed, with a message of failure" : "failed, without a message";
  if (passed && verdict != "same" && verdict != "within")
    return "passed, with the verdict " + verdict;
  for (const JsonValue& metric : list_at(entry, "figures"))
    if (passed && flag_at(metric, "over"))
      return "passed, with " + text_at(metric, "name") + " over its limit";
  return "";
}

/// Checks that the report, its page and its JUnit agree on each case. Throws FormatError if a value
/// is missing or has the wrong type. Errors: kInput.
Status check_shard(const fs::path& path, const Shard& shard) {
  const auto error = [&](const std::string& text) {
    return make_error(ErrorCode::kInput, "{}: {} - give reports as they were written",
                      path.string(), printable(text));
  };
  const JsonValue& report = shard.report;
  text_at(report, "title");
  for (const JsonValue* json : {&shard.report, &shard.page})
    for (const JsonValue& note : list_at(*json, "notes"))
      if (!note.is_string()) throw FormatError("a note must be a string");
  if (report.contains("suites")) {
    const JsonValue& suites = member(report, "suites", JsonValue::Kind::kObject);
    for (const JsonMember& suite : suites.members) text_at(suites, suite.key.c_str());
  }
  std::map<std::string, bool> passed_on_page;
  for (const JsonValue& entry : shard.page.get("cases").items)
    passed_on_page[case_name(entry)] = flag_at(entry, "passed");
  for (const JsonValue& entry : report.get("cases").items) {
    const std::string name = case_name(entry), contradiction = find_contradiction(entry);
    if (!contradiction.empty()) return error(name + ": " + contradiction);
    const auto page_case = passed_on_page.find(name);
    if (page_case == passed_on_page.end() || page_case->second != flag_at(entry, "passed"))
      return error(name + ": its page says something else than report.json");
  }
  const CaseCounts counts = count_cases(report.get("cases"));
  if (counts.all == 0) return error("no case in it");
  const CaseCounts stated_counts{count_at(report, "passed") + count_at(report, "failed"),
                                 count_at(report, "failed"), count_at(report, "errors")};
  if (stated_counts != counts || shard.page.get("cases").size() != counts.all)
    return error("report.json counts other cases than it has");
  const CaseCounts junit_counts{
      count_occurrences(shard.junit, "<testcase "),
      count_occurrences(shard.junit, "<failure ") + count_occurrences(shard.junit, "<error "),
      count_occurrences(shard.junit, "<error ")};
  if (junit_counts != counts) return error("junit.xml has other cases than report.json");
  return Ok{};
}

/// Tests for the path of a failed frame that `golden test` kept: SUITE/frame.####.actual.EXT,
/// .reference.exr or .difference.png.
bool is_kept_frame(const std::string& name) {
  for (const char* infix : {".actual.", ".reference.", ".difference."})
    if (name.find('/') != std::string::npos && name.find(infix) != std::string::npos) return true;
  return false;
}

/// Tests for the path of a file that belongs to a report, in its folder or below.
bool is_report_file(const std::string& name) {
  if (name.starts_with('/') || name.starts_with("../")) return false;
  for (const char* end : {".png", "report.json", "index.html", "junit.xml"})
    if (name.ends_with(end)) return true;
  return is_kept_frame(name);
}

/// Reads the files of the topmost report in `path`, a folder or an archive. Keys are paths relative
/// to the report's folder.
Result<std::map<std::string, std::string>> report_files(const fs::path& path) {
  PM_TRY(const auto tree, read_tree(path, is_report_file));
  // The report's folder is the one whose report.json has the shortest path.
  std::optional<std::string> folder;
  for (const auto& [name, bytes] : tree) {
    if (fs::path(name).filename() != "report.json") continue;
    const std::string parent = name.substr(0, name.size() - std::string("report.json").size());
    if (!folder || parent.size() < folder->size()) folder = parent;
  }
  std::map<std::string, std::string> files;
  for (const auto& [name, bytes] : tree) {
    if (!name.starts_with(folder.value_or(""))) continue;
    const std::string inner_path = name.substr(folder.value_or("").size());
    if (inner_path.find('/') == std::string::npos || is_kept_frame(inner_path))
      files[inner_path] = bytes;
  }
  return files;
}

/// Reads and checks a report in a folder or an archive.
Result<Shard> read_shard(const fs::path& path) {
  PM_TRY(auto files, report_files(path));
  const auto take = [&](const char* name) -> Result<std::string> {
    const auto file = files.extract(name);  // pictures and kept frames are left in `files`
    if (file.empty())
      return make_error(ErrorCode::kInput, "{}: no {} in it - give the folder of --report",
                        path.string(), name);
    remember_input(path / name);
    return file.mapped();
  };
  Shard shard;
  PM_TRY(const std::string report, take("report.json"));
  PM_TRY(shard.report, parse_report(path / "report.json", report));
  PM_TRY(const std::string page, take("index.html"));
  PM_TRY(const std::string data, extract_between(path / "index.html", page, kDataBegin, kDataEnd));
  PM_TRY(shard.page, parse_report(path / "index.html", data));
  PM_TRY(const std::string junit, take("junit.xml"));
  const auto first = junit.find("  <testsuite "), last = junit.rfind("</testsuites>");
  if (last != std::string::npos && first != std::string::npos)
    shard.junit = junit.substr(first, last - first);
  PM_TRY_STATUS(check_shard(path, shard));
  shard.files = std::move(files);
  return shard;
}

/// Appends the list `key` of `source` to the list `key` of `target`.
void append(JsonValue& target, const JsonValue& source, const char* key) {
  for (const JsonValue& entry : list_at(source, key)) target[key].push_back(entry);
}

/// Adds a report to the merged one. `case_names` holds the names of all cases added so far.
Status add_shard(const fs::path& path, Shard shard, Shard& merged,
                 std::set<std::string>& case_names) {
  if (merged.report.is_null()) {  // the first report
    merged.report = shard.report;
    merged.page = shard.page;
    for (JsonValue* json : {&merged.report, &merged.page})
      (*json)["cases"] = (*json)["notes"] = JsonValue::array();
  } else if (format_json(merged.report.get("facts")) != format_json(shard.report.get("facts"))) {
    return make_error(ErrorCode::kInput,
                      "{}: of another program, device or instruction set than the first report",
                      path.string());
  }
  for (const JsonValue& entry : shard.report.get("cases").items)
    if (!case_names.insert(case_name(entry)).second)
      return make_error(ErrorCode::kInput, "{}: {} stands in another report, too", path.string(),
                        printable(case_name(entry)));
  for (const char* key : {"cases", "notes"}) {
    append(merged.report, shard.report, key);
    append(merged.page, shard.page, key);
  }
  if (shard.report.contains("suites")) merged.report["suites"].update(shard.report.get("suites"));
  merged.junit += shard.junit;
  merged.files.merge(shard.files);
  return Ok{};
}

/// Returns the folder of a path to report.json, and other paths unchanged.
fs::path report_folder(const fs::path& path) {
  if (path.filename() != "report.json") return path;
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

/// Writes the merged report's files, with `counts` in place of the counts of the first report.
Status write_merged(Shard& merged, const CaseCounts& counts, const fs::path& folder,
                    bool overwrite) {
  merged.report["failed"] = counts.failed;
  merged.report["errors"] = counts.errors;
  merged.report["passed"] = counts.all - counts.failed;
  // List the files at the top of the folder, which remove_report() may remove later.
  std::vector<std::string> names{"index.html", "junit.xml", "report.json"};
  for (const auto& [name, bytes] : merged.files)
    if (fs::path(name).filename() == name) names.push_back(name);
  for (const std::string& name : names) PM_TRY_STATUS(check_output(folder / name, overwrite));
  merged.report["polymorph_report"] = names;
  const std::string title = merged.report.get("title").string;
  PM_TRY_STATUS(write_file(folder / "report.json", dump_json(merged.report)));
  for (const auto& [name, bytes] : merged.files) PM_TRY_STATUS(write_file(folder / name, bytes));
  PM_TRY_STATUS(
      write_file(folder / "junit.xml",
                 fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"{}\" "
                             "tests=\"{}\" failures=\"{}\" errors=\"{}\">\n{}</testsuites>\n",
                             escape_markup(title), counts.all, counts.failed - counts.errors,
                             counts.errors, merged.junit)));
  return write_file(folder / "index.html", make_page(title, merged.page));
}

}  // namespace

Status check_merge_output(const std::vector<fs::path>& reports, const fs::path& folder) {
  for (const fs::path& report : reports) {
    if (is_in_folder(folder, report_folder(report)))
      return make_error(ErrorCode::kUsage,
                        "{}: one of the reports to merge, or in one - give -o another folder",
                        folder.string());
  }
  return Ok{};
}

Result<std::size_t> merge_reports(const std::vector<fs::path>& reports, const fs::path& folder,
                                  bool overwrite) {
  PM_TRY_STATUS(check_merge_output(reports, folder));
  Shard merged;
  std::set<std::string> case_names;
  for (const fs::path& report : reports) {
    const fs::path path = report_folder(report);
    try {
      PM_TRY(Shard shard, read_shard(path));
      PM_TRY_STATUS(add_shard(path, std::move(shard), merged, case_names));
    } catch (const FormatError& e) {
      return make_error(ErrorCode::kInput, "{}: not a report of polymorph: {}", path.string(),
                        e.what());
    }
  }
  const CaseCounts counts = count_cases(merged.report["cases"]);
  PM_TRY_STATUS(remove_report(folder));
  PM_TRY_STATUS(write_merged(merged, counts, folder, overwrite));
  return counts.failed;
}

}  // namespace polymorph
