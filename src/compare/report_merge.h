// The reports of several shards as one.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// Puts the reports of `golden test --report` or `compare --report` (folders, or their report.json)
/// together in `folder`: report.json, junit.xml, one page, the pictures and the frames that were
/// kept, so that `golden accept` takes it. Each case may stand in one of them only, and all must be
/// of the same program. Returns how many cases failed. Errors: kInput, kOutput.
Result<std::size_t> merge_reports(const std::vector<std::filesystem::path>& reports,
                                  const std::filesystem::path& folder);

}  // namespace polymorph
