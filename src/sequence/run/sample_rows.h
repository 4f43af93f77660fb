// Frames of a sequence that are in parts, grouped by the samples that their parts have.
#pragma once

#include <filesystem>
#include <set>
#include <span>
#include <vector>

#include "render/sample_range.h"
#include "sequence/run/status.h"

namespace polymorph {

/// Frames of which parts with the same samples exist.
struct SampleRow {
  std::vector<SampleRange> ranges;  ///< disjoint, in order (join_ranges())
  std::vector<int> frames;
  std::set<std::filesystem::path> folders;  ///< folders of their parts
  int total() const { return ranges.front().total; }
  bool is_complete() const { return ranges.size() == 1 && ranges.front().is_whole(); }
};

/// Finds the parts of the frames that are not whole in the folder of the output, and groups the
/// frames by the samples that their parts have.
std::vector<SampleRow> find_samples(const std::filesystem::path& folder,
                                    std::span<const int> frames, std::span<const FileState> states,
                                    const ExpectedHashes& hashes);

}  // namespace polymorph
