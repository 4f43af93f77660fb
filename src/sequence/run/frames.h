// Frame ranges and file name patterns: "1-48x2,60", "frame.####.exr", shards.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// A frame list in oiiotool's grammar, in the order given, duplicates dropped:
///   1-48    1..48          5-1      backwards      1,5,10-20  a list       1..48  as 1-48
///   1-48x2  every second   1-48y2   those that 1-48x2 leaves out
/// Errors (kUsage): syntax, or a frame outside [first, last].
Result<std::vector<int>> parse_frames(std::string_view text, int first, int last);

/// A file name with a place for the frame number: "out/frame.####.exr" (n hashes = n digits) or
/// "out/frame.%04d.exr"; "%%" is a percent sign. The number may only stand in the file name.
struct FramePattern {
  std::string before, after;
  int digits = 0;  ///< 0 = no place for a number
  bool has_number() const { return digits > 0; }
};

/// The files of a sequence's frames.
struct FrameFiles {
  FramePattern exr, png;  ///< empty: none of that format
};

/// Errors (kUsage): a lone '#', two places for a number, a place in a folder's name, no file name.
Result<FramePattern> parse_pattern(const std::string& text);

/// ".####" is put before the extension when more than one frame goes to a name without a place for
/// its number.
FramePattern add_number(FramePattern pattern);

std::filesystem::path frame_path(const FramePattern& pattern, int frame);
/// Replaces the extension of the pattern (".png").
FramePattern with_extension(FramePattern pattern, const std::string& extension);

/// Frames that exist on disk under this pattern, ascending. Errors (kInput): unreadable folder.
Result<std::vector<int>> existing_frames(const FramePattern& pattern);

/// Every n-th frame, the i-th share first (1-based): "2/8"; "auto" reads Slurm's array or MPI's
/// rank from the environment. Errors (kUsage).
struct Shard {
  int index = 1, count = 1;
};
Result<Shard> parse_shard(std::string_view text);
std::vector<int> take_shard(const std::vector<int>& frames, Shard shard);

}  // namespace polymorph
