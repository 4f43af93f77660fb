// Report options (--report, --html and --junit) of the commands that compare images, and limits
// (--fail-on) of the commands that measure morphs.
#pragma once

#include <string>
#include <vector>

#include "analyze/analysis_report.h"
#include "cli/command_line.h"
#include "compare/comparison_report.h"

namespace polymorph {

/// Values of --report, --html and --junit.
struct ReportOptions {
  std::string folder, html, junit;  ///< paths; empty: not written
  /// Tests whether a page with pictures is written.
  bool has_pictures() const { return !folder.empty() || !html.empty(); }
};
/// Adds --report, --html and --junit.
void add_report(Command command, ReportOptions& options);

/// Checks before any work that the report's folder can be written. (run_program() checks the files
/// of --html and --junit.) Removes an earlier report from the folder, which would be mistaken for
/// this run's if the run fails. Errors: kOutput, also if the folder has other files of the report's
/// names and `overwrite` is false.
Status begin_report(const ReportOptions& options, bool overwrite);
/// Writes the reports that the options name. Errors: kOutput.
Status write_reports(const ReportOptions& options, const Report& report, bool overwrite);

/// Parses the values of --fail-on. Errors: those of parse_limit().
Result<std::vector<Limit>> parse_limits(const std::vector<std::string>& texts);
/// Logs the limits that do not hold. Returns the exit code: 0 if all hold, else kAnswerNo.
int check_limits(const std::vector<Analysis>& morphs, const std::vector<Limit>& limits);

}  // namespace polymorph
