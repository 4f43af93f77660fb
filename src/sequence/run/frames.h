// Frame ranges and shards: "1-48x2,60", "2/8".
#pragma once

#include <string_view>
#include <vector>

#include "base/frame_pattern.h"
#include "base/result.h"

namespace polymorph {

/// A frame list in oiiotool's grammar, in the order given, duplicates dropped:
///   1-48    1..48          5-1      backwards      1,5,10-20  a list       1..48  as 1-48
///   1-48x2  every second   1-48y2   those that 1-48x2 leaves out
/// Errors (kUsage): syntax, or a frame outside [first, last].
Result<std::vector<int>> parse_frames(std::string_view text, int first, int last);

/// The files of a sequence's frames.
struct FrameFiles {
  FramePattern exr, png;  ///< empty: none of that format
};

/// Every n-th frame, the i-th share first (1-based): "2/8"; "auto" reads Slurm's array or MPI's
/// rank from the environment. Errors (kUsage).
struct Shard {
  int index = 1, count = 1;
};
Result<Shard> parse_shard(std::string_view text);
std::vector<int> take_shard(const std::vector<int>& frames, Shard shard);

}  // namespace polymorph
