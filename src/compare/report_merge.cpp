#include "compare/report_merge.h"

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/archive.h"
#include "base/file.h"
#include "base/text.h"
#include "compare/comparison_report.h"
#include "compare/report_data.h"
#include "scene/json_text.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kDataBegin = "<script type=\"application/json\" id=\"data\">";
constexpr const char* kDataEnd = "</script>";
constexpr int kDeepest = 16;

Result<Json> parse(const fs::path& file, const std::string& text) {
  const auto shallow = [](int depth, Json::parse_event_t, Json&) { return depth < kDeepest; };
  Json json = Json::parse(text, shallow, false);
  if (!json.is_object() || !json.contains("cases") || !json["cases"].is_array())
    return make_error(ErrorCode::kInput, "{}: not a report of polymorph", file.string());
  return json;
}

/// The part of `text` between two marks, from `at` on.
Result<std::string> between(const fs::path& file, const std::string& text, const std::string& begin,
                            const std::string& end) {
  const auto from = text.find(begin);
  const auto to = from == std::string::npos ? from : text.find(end, from + begin.size());
  if (to == std::string::npos)
    return make_error(ErrorCode::kInput, "{}: not of a report of polymorph", file.string());
  return text.substr(from + begin.size(), to - from - begin.size());
}

/// All of `one`'s entries of a list behind those of `all`.
void append(Json& all, const Json& one, const char* key) {
  if (!one.contains(key) || !one[key].is_array()) return;
  for (const Json& entry : one[key]) all[key].push_back(entry);
}

struct Merged {
  Json report, page;
  std::string junit;  ///< the <testsuite> elements
  std::set<std::string> cases;
  std::map<std::string, std::string> files;  ///< pictures and frames
};

Status add(Merged& merged, fs::path path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) path = path.parent_path();
  PM_TRY(const auto files, read_tree(path, [](const std::string&) { return true; }));
  const auto text = [&](const char* name) -> Result<std::string> {
    const auto file = files.find(name);
    if (file == files.end())
      return make_error(ErrorCode::kInput, "{}: no {} in it - give the folder of --report",
                        path.string(), name);
    return file->second;
  };
  PM_TRY(const std::string report_text, text("report.json"));
  PM_TRY(const Json report, parse(path / "report.json", report_text));
  PM_TRY(const std::string page_text, text("index.html"));
  PM_TRY(const std::string page_data,
         between(path / "index.html", page_text, kDataBegin, kDataEnd));
  PM_TRY(const Json page, parse(path / "index.html", page_data));
  PM_TRY(const std::string junit_text, text("junit.xml"));
  const auto first = junit_text.find("  <testsuite ");
  const auto last = junit_text.rfind("</testsuites>");
  if (last != std::string::npos && first != std::string::npos)
    merged.junit += junit_text.substr(first, last - first);
  if (merged.report.is_null()) {
    merged.report = report;
    merged.page = page;
    for (Json* one : {&merged.report, &merged.page})
      (*one)["cases"] = (*one)["notes"] = Json::array();
  } else if (merged.report.value("facts", Json()) != report.value("facts", Json())) {
    return make_error(ErrorCode::kInput,
                      "{}: of another program, device or instruction set than the first report",
                      path.string());
  }
  for (const Json& one : report["cases"]) {
    const std::string name = one.value("group", "") + ", " + one.value("name", "");
    if (!merged.cases.insert(name).second)
      return make_error(ErrorCode::kInput, "{}: {} stands in another report, too", path.string(),
                        printable(name));
  }
  append(merged.report, report, "cases");
  append(merged.report, report, "notes");
  append(merged.page, page, "cases");
  append(merged.page, page, "notes");
  if (report.contains("suites")) merged.report["suites"].update(report["suites"]);
  for (const auto& [name, bytes] : files)
    if (name != "report.json" && name != "index.html" && name != "junit.xml")
      merged.files[name] = bytes;
  return Ok{};
}

std::size_t count(const Json& cases, const char* verdict) {
  std::size_t sum = 0;
  for (const Json& one : cases) {
    const bool passed = one.value("passed", false), error = one.value("verdict", "") == "error";
    sum += std::string_view(verdict) == "errors" ? error : !passed;
  }
  return sum;
}

}  // namespace

Result<std::size_t> merge_reports(const std::vector<fs::path>& reports, const fs::path& folder) {
  Merged merged;
  for (const fs::path& report : reports) PM_TRY_STATUS(add(merged, report));
  const std::size_t failed = count(merged.report["cases"], "failed");
  const std::size_t errors = count(merged.report["cases"], "errors");
  merged.report["failed"] = failed;
  merged.report["errors"] = errors;
  merged.report["passed"] = merged.report["cases"].size() - failed;
  std::vector<std::string> names{"index.html", "junit.xml", "report.json"};
  for (const auto& [name, bytes] : merged.files)
    if (fs::path(name).filename() == name) names.push_back(name);
  merged.report["polymorph_report"] = names;
  const std::string title = merged.report.value("title", "");
  PM_TRY_STATUS(remove_report(folder));
  PM_TRY_STATUS(write_file(folder / "report.json", dump_json(merged.report)));
  for (const auto& [name, bytes] : merged.files) PM_TRY_STATUS(write_file(folder / name, bytes));
  PM_TRY_STATUS(
      write_file(folder / "junit.xml",
                 fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"{}\" "
                             "tests=\"{}\" failures=\"{}\" errors=\"{}\">\n{}</testsuites>\n",
                             escape_markup(title), merged.report["cases"].size(), failed - errors,
                             errors, merged.junit)));
  PM_TRY_STATUS(write_file(folder / "index.html", page_of(title, merged.page)));
  return failed;
}

}  // namespace polymorph
