#include "cli/report_options.h"

#include "base/file.h"
#include "base/log.h"

namespace polymorph {

void add_report(Command command, ReportOptions& options) {
  command
      .add_option("--report", options.folder, "DIR",
                  "index.html, junit.xml, report.json, and a picture of each failure")
      .group("Output");
  command.add_option("--html", options.html, "FILE", "the page alone: one file, opens from disk")
      .group("Output");
  command.add_option("--junit", options.junit, "FILE", "JUnit XML, a test case per frame")
      .group("Output");
}

Status begin_report(const ReportOptions& options, bool overwrite) {
  if (options.folder.empty()) return Ok{};
  const std::filesystem::path folder(options.folder);
  PM_TRY_STATUS(check_writable(folder / "index.html"));
  PM_TRY_STATUS(remove_report(folder));
  for (const char* name : {"index.html", "junit.xml", "report.json"})
    PM_TRY_STATUS(check_output(folder / name, overwrite));
  return Ok{};
}

Status write_reports(const ReportOptions& options, const Report& report, bool overwrite) {
  if (!options.junit.empty()) PM_TRY_STATUS(write_file(options.junit, report_junit(report)));
  if (!options.html.empty()) {
    PM_TRY_STATUS(write_file(options.html, report_html(report)));
    log_info("report: {}", options.html);
  }
  if (!options.folder.empty()) {
    PM_TRY(const auto page, write_report_folder(report, options.folder, overwrite));
    log_info("report: {}", page.string());
  }
  return Ok{};
}

Result<std::vector<Limit>> parse_limits(const std::vector<std::string>& texts) {
  std::vector<Limit> limits;
  for (const std::string& text : texts) {
    PM_TRY(Limit limit, parse_limit(text));
    limits.push_back(std::move(limit));
  }
  return limits;
}

int check_limits(const std::vector<Analysis>& morphs, const std::vector<Limit>& limits) {
  const std::vector<std::string> messages = broken_limits(morphs, limits);
  for (const std::string& text : messages) log_warning("{}", text);
  return messages.empty() ? 0 : static_cast<int>(ErrorCode::kAnswerNo);
}

}  // namespace polymorph
