// Names of numbered files: "frame.####.exr", and which of them exist.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// A file name with a place for the frame number: "out/frame.####.exr" (n hashes = n digits) or
/// "out/frame.%04d.exr"; "%%" is a percent sign. The number may only stand in the file name.
struct FramePattern {
  std::string before, after;
  int digits = 0;  ///< 0 = no place for a number
  bool has_number() const { return digits > 0; }
};

/// Errors (kUsage): a lone '#', two places for a number, a place in a folder's name, no file name.
Result<FramePattern> parse_pattern(const std::string& text);

/// The pattern of a file in a folder whose name is taken as it is. Errors: as above.
Result<FramePattern> file_pattern(const std::filesystem::path& file);

/// ".####" is put before the extension when more than one frame goes to a name without a place for
/// its number.
FramePattern add_number(FramePattern pattern);

std::filesystem::path frame_path(const FramePattern& pattern, int frame);
/// Replaces the extension of the pattern (".png").
FramePattern with_extension(FramePattern pattern, const std::string& extension);

/// Frames that exist on disk under this pattern, ascending. Errors (kInput): unreadable folder.
Result<std::vector<int>> existing_frames(const FramePattern& pattern);

}  // namespace polymorph
