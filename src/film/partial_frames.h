// Frames of a sequence of which only parts are rendered (film/part_files.h), grouped by the samples
// that their parts have.
#pragma once

#include <filesystem>
#include <set>
#include <span>
#include <vector>

#include "film/status.h"
#include "render/sample_range.h"

namespace polymorph {

/// Frames of which the existing parts have the same samples.
struct PartialFrames {
  std::vector<SampleRange> ranges;                    ///< join_ranges() of the parts; not empty
  std::vector<int> frames;                            ///< ascending
  std::set<std::filesystem::path> folders;            ///< folders of the frames' parts
  int total() const { return ranges.front().total; }  ///< samples of a whole frame
  bool is_complete() const { return ranges.size() == 1 && ranges.front().is_whole(); }
};

/// Finds the parts, in `folder` and its subfolders, of the frames whose state is not kCurrent, and
/// groups these frames by the samples that their parts have. The groups are sorted by the text of
/// their ranges (format_samples()). `frames` must be ascending; `states` and hashes.frames have one
/// element per frame.
std::vector<PartialFrames> find_partial_frames(const std::filesystem::path& folder,
                                               std::span<const int> frames,
                                               std::span<const FileState> states,
                                               const ExpectedHashes& hashes);

}  // namespace polymorph
