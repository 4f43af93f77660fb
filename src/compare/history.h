// History of a golden suite's differences over time: history.csv beside suite.json.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "compare/comparison_report.h"

namespace polymorph {

/// Empty where there is no file. Errors: kInput with the line.
Result<std::vector<HistoryRow>> read_history(const std::filesystem::path& csv);
std::string history_text(const std::vector<HistoryRow>& rows);

/// The rows of a run of a suite; its cases are those of `group`. A limit of 0 is kept wholly or
/// not at all: the share is 0 or infinite.
std::vector<HistoryRow> history_rows(const std::vector<ReportCase>& cases, const std::string& group,
                                     const std::string& commit);

/// What was tested: GITHUB_SHA or CI_COMMIT_SHA, else the commit that this program was built from.
std::string tested_commit();

/// The metrics whose mean rose in each of the last four runs while all stayed within their limits:
/// differences that grow unseen.
std::vector<std::string> rising_metrics(const std::vector<HistoryRow>& rows);

}  // namespace polymorph
