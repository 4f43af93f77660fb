// Report options (--report, --html and --junit) of the commands that compare images.
#pragma once

#include <string>

#include "cli/command_line.h"
#include "compare/comparison_report.h"

namespace polymorph {

struct ReportOptions {
  std::string folder, html, junit;
  bool pictures() const { return !folder.empty() || !html.empty(); }
};
void add_report(Command command, ReportOptions& options);

/// Before any work: fails if the folder could not be written to after it or has other files of
/// these names, and removes its earlier report, which else would stand for a run that ends without
/// one.
Status begin_report(const ReportOptions& options, bool overwrite);
Status write_reports(const ReportOptions& options, const Report& report, bool overwrite);

}  // namespace polymorph
