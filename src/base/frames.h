// Frame ranges and shards: "1-48x2,60", "2/8".
#pragma once

#include <string_view>
#include <vector>

#include "base/frame_pattern.h"
#include "base/result.h"

namespace polymorph {

/// Parses a frame list in oiiotool's grammar. Keeps its order and drops duplicates.
///   1-48    1 to 48        5-1      backwards      1,5,10-20  a list       1..48  as 1-48
///   1-48x2  every second   1-48y2   the frames that 1-48x2 leaves out
/// Errors: kUsage for bad syntax, a frame outside [first, last], or a list without frames.
Result<std::vector<int>> parse_frames(std::string_view text, int first, int last);

/// Parses a frame list; an empty one is all frames of [first, last].
Result<std::vector<int>> parse_frames_or_all(std::string_view text, int first, int last);

/// The files of a sequence's frames.
struct FrameFiles {
  FramePattern exr, png;  ///< empty: no files of that format
};

/// Every `count`-th frame of a list, beginning with the `index`-th (from 1).
struct Shard {
  int index = 1, count = 1;
};
/// Parses "2/8" (index / count); "auto" reads Slurm's array task or MPI's rank from the
/// environment. Errors: kUsage.
Result<Shard> parse_shard(std::string_view text);
/// Returns the frames of a shard.
std::vector<int> take_shard(const std::vector<int>& frames, Shard shard);

}  // namespace polymorph
