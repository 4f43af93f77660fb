// Sample ranges: "0-15/64" are the first 16 of a picture's 64 samples per pixel, rendered as a part
// of the picture (film/part.h).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "render/film/sample_sums.h"

namespace polymorph {

inline constexpr int kMaxSamples = 65536;  ///< limit of image.samples

/// The samples [first, end) of a picture of `total` samples per pixel. `first` and `end` are
/// multiples of kSampleBlock, except that `end` may be `total`.
struct SampleRange {
  int first = 0, end = 0, total = 0;
  int count() const { return end - first; }
  bool is_whole() const { return first == 0 && end == total; }
  int first_block() const { return first / kSampleBlock; }
  int block_count() const { return (end + kSampleBlock - 1) / kSampleBlock - first_block(); }
};

/// Parses "FIRST-LAST/TOTAL". Errors (kUsage): wrong syntax, or a range that is not made of whole
/// blocks.
Result<SampleRange> parse_sample_range(std::string_view text);

/// Formats the numbers of the first and last sample, such as "0-15".
std::string format_samples(int first, int end);
/// Formats a range, such as "0-15/64".
std::string format_sample_range(const SampleRange& range);

/// Lists the tree nodes in which SampleSums holds the sums over the range, in ascending order.
std::vector<BlockSpan> list_nodes(const SampleRange& range);

/// Counts the samples of a node in a picture of `total` samples per pixel.
int count_samples(BlockSpan node, int total);

}  // namespace polymorph
