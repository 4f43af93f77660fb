// Bit test of a build: a golden suite's frames, rendered in every way that must not matter.
#pragma once

#include <vector>

#include "base/result.h"
#include "compare/comparison_report.h"
#include "compare/golden.h"
#include "golden/golden_run.h"

namespace polymorph {

/// Renders the suite's frames in every way that must not matter and compares decoded pixels and
/// surfaces to the bit: again; 1 and 3 threads; in shards; interrupted and resumed; with a cold and
/// a warm cache; a frame alone. One case per way; works in a folder of its own that it removes. The
/// goldens take no part. Errors: kInput, kResource, kOutput.
Result<std::vector<ReportCase>> test_golden_bits(const GoldenSuite& suite,
                                                 const GoldenSettings& settings);

}  // namespace polymorph
