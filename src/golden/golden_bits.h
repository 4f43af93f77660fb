// Bit test of a build: a golden suite's frames, rendered in several ways, must have equal bits.
#pragma once

#include <vector>

#include "base/result.h"
#include "compare/comparison_report.h"
#include "compare/golden.h"
#include "golden/golden_run.h"

namespace polymorph {

/// Renders the suite's frames in several ways and compares their decoded pixels and surfaces with
/// each other, to the bit: again; with 1 and 3 threads; in shards; interrupted and resumed; with a
/// cold and a warm cache; one frame alone. Returns a case per way. Does not read the golden frames.
/// Works in a temporary folder. Errors: kInput, kResource, kOutput.
Result<std::vector<ReportCase>> test_golden_bits(const GoldenSuite& suite,
                                                 const GoldenSettings& settings);

}  // namespace polymorph
