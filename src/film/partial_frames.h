// Frames of a sequence that are not whole but rendered in parts (film/part_files.h),
// grouped by the samples that their parts have.
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
  std::vector<SampleRange> ranges;  ///< join_ranges() of the parts; not empty
  std::vector<int> frames;
  std::set<std::filesystem::path> folders;            ///< folders of their parts
  int total() const { return ranges.front().total; }  ///< samples of a whole frame
  bool is_complete() const { return ranges.size() == 1 && ranges.front().is_whole(); }
};

/// Finds the parts, in `folder` and its subfolders, of the frames whose state is not kCurrent, and
/// groups these frames by the samples that their parts have. `states` and hashes.frames: one per
/// frame; `frames` must be ascending.
std::vector<PartialFrames> find_partial_frames(const std::filesystem::path& folder,
                                               std::span<const int> frames,
                                               std::span<const FileState> states,
                                               const ExpectedHashes& hashes);

}  // namespace polymorph
