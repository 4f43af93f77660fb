// The reports of several shards as one.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// Fails where `folder` is the folder of one of the reports, which would be gone before it is read.
/// Errors: kUsage.
Status check_merge_output(const std::vector<std::filesystem::path>& reports,
                          const std::filesystem::path& folder);

/// Puts the reports of `golden test --report` or `compare --report` (folders, their report.json,
/// .zip or .tar) together in `folder`, in place of an earlier report there: report.json, junit.xml,
/// one page, the pictures and the frames that were kept, so that `golden accept` takes it. Other
/// files of these names are replaced only with `overwrite`. Each case may stand in one of them
/// only, and all must be of the same program. A report without cases, one whose page, JUnit or
/// counts say something else than its cases, and a case that passed although its verdict or one of
/// its figures failed are refused. Returns how many cases failed. Errors: those of
/// check_merge_output(), kInput, kOutput.
Result<std::size_t> merge_reports(const std::vector<std::filesystem::path>& reports,
                                  const std::filesystem::path& folder, bool overwrite);

}  // namespace polymorph
