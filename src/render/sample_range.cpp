#include "render/sample_range.h"

#include <algorithm>

#include "base/text.h"

namespace polymorph {
namespace {

/// A sum without a value: SampleSums<NoSum> only finds the nodes.
struct NoSum {
  void add(NoSum) {}
};

int round_up(int samples) { return (samples + kSampleBlock - 1) / kSampleBlock * kSampleBlock; }

}  // namespace

Result<SampleRange> parse_sample_range(std::string_view text) {
  const auto slash = text.find('/'), dash = text.find('-');
  if (slash == std::string_view::npos || dash == std::string_view::npos || dash > slash)
    return make_error(ErrorCode::kUsage,
                      "--samples {}: write FIRST-LAST/TOTAL, as in 0-15/64, or a number", text);
  const auto first = parse_integer(text.substr(0, dash)),
             last = parse_integer(text.substr(dash + 1, slash - dash - 1)),
             total = parse_integer(text.substr(slash + 1));
  if (!first || !last || !total || *total < 1 || *total > kMaxSamples || *first < 0 ||
      *first > *last || *last >= *total)
    return make_error(ErrorCode::kUsage,
                      "--samples {}: write FIRST-LAST/TOTAL with 0 <= FIRST <= LAST < TOTAL, and "
                      "TOTAL at most {}",
                      text, kMaxSamples);
  const SampleRange range{static_cast<int>(*first), static_cast<int>(*last) + 1,
                          static_cast<int>(*total)};
  const int begin = range.first / kSampleBlock * kSampleBlock,
            end = std::min(round_up(range.end), range.total);
  if (begin != range.first || end != range.end)
    return make_error(ErrorCode::kUsage,
                      "--samples {}: ranges begin and end at multiples of {} samples - write {}",
                      text, kSampleBlock, format_sample_range({begin, end, range.total}));
  return range;
}

std::string format_samples(int first, int end) { return fmt::format("{}-{}", first, end - 1); }

std::string format_sample_range(const SampleRange& range) {
  return fmt::format("{}/{}", format_samples(range.first, range.end), range.total);
}

std::vector<BlockSpan> list_nodes(const SampleRange& range) {
  SampleSums<NoSum> sums;
  for (int block = range.first / kSampleBlock; block * kSampleBlock < range.end; ++block)
    sums.end_block(block);
  std::vector<BlockSpan> nodes;
  for (const auto& node : sums.nodes()) nodes.push_back(node.blocks);
  return nodes;
}

int count_samples(BlockSpan node, int total) {
  return std::min(node.end() * kSampleBlock, total) - node.first * kSampleBlock;
}

}  // namespace polymorph
