// Report options (--report, --html and --junit) of the commands that compare images.
#pragma once

#include <string>

#include "cli/command_line.h"
#include "compare/comparison_report.h"

namespace polymorph {

struct ReportOptions {
  std::string folder, html, junit;
  /// Tests whether a page with pictures is written.
  bool has_pictures() const { return !folder.empty() || !html.empty(); }
};
void add_report(Command command, ReportOptions& options);

/// Checks before any work that the report can be written, and removes an earlier report from the
/// folder, which would be mistaken for this run's if the run fails. Errors: kOutput, also if the
/// folder has other files of the report's names and `overwrite` is false.
Status begin_report(const ReportOptions& options, bool overwrite);
Status write_reports(const ReportOptions& options, const Report& report, bool overwrite);

}  // namespace polymorph
