// Merging of the comparison reports of several shards into one.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// Checks that `folder` neither is nor lies in the folder of one of the reports, because merging
/// would replace that report. Errors: kUsage.
Status check_merge_output(const std::vector<std::filesystem::path>& reports,
                          const std::filesystem::path& folder);

/// Merges reports of `golden test --report` or `compare --report` (folders, their report.json, .zip
/// or .tar) into `folder`, in place of an earlier report there: report.json, junit.xml, one page,
/// the pictures and the frames that were kept, so that `golden accept` takes it. Other files of
/// these names are replaced only with `overwrite`. Each case may be in one report only, and all
/// reports must be of the same program. A report is refused if it has no cases, if its page,
/// JUnit or counts contradict its cases, or if a case passed although its verdict or one of its
/// metrics failed. Returns the number of failed cases. Errors: those of
/// check_merge_output(), kInput, kOutput.
Result<std::size_t> merge_reports(const std::vector<std::filesystem::path>& reports,
                                  const std::filesystem::path& folder, bool overwrite);

}  // namespace polymorph
