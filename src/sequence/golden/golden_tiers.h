// Golden tests without reference images: bit-identical results within one build, and noise that is
// unbiased.
#pragma once

#include <vector>

#include "base/result.h"
#include "compare/comparison_report.h"
#include "compare/golden.h"
#include "sequence/golden/golden_run.h"

namespace polymorph {

/// Renders the suite's frames in every way that must not matter and compares decoded pixels and
/// surfaces to the bit: again; 1 and 3 threads; in shards; interrupted and resumed; with a cold and
/// a warm cache; a frame alone. One case per way; works in a folder of its own that it removes. The
/// goldens take no part. Errors: kInput, kResource, kOutput.
Result<std::vector<ReportCase>> test_golden_bits(const GoldenSuite& suite,
                                                 const GoldenSettings& settings);

/// Renders each frame `runs` (at least 4) times under other seeds and asks whether the golden could
/// be one of them (compare/statistics.h): the test for changes of the sampler, or of the number of
/// samples, which move every pixel. One case per frame.
Result<std::vector<ReportCase>> test_golden_statistics(const GoldenSuite& suite,
                                                       const GoldenSettings& settings, int runs);

}  // namespace polymorph
