// Bit test of a build: a golden suite's frames must have equal bits however they are rendered.
#pragma once

#include <vector>

#include "base/result.h"
#include "compare/comparison_report.h"
#include "compare/golden.h"
#include "golden/golden_run.h"

namespace polymorph {

/// Renders the suite's frames once, and then in several other ways: again; with 1 and 3 threads; in
/// shards; interrupted and resumed; with a cold and a warm cache; one frame alone. Compares decoded
/// pixels and surfaces with those of the first time, to the bit. Returns one case per other way.
/// Does not read the golden frames. Works in a temporary folder. Errors: kInput, kResource,
/// kOutput.
Result<std::vector<ReportCase>> test_golden_bits(const GoldenSuite& suite,
                                                 const GoldenSettings& settings);

}  // namespace polymorph
