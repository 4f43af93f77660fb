// Patterns for the names of numbered files, such as "frame.####.exr", and lists of the numbers that
// exist.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// A path with a place for the frame number in its file name: "out/frame.####.exr" (n hashes = n
/// digits) or "out/frame.%04d.exr"; "%%" is a percent sign.
struct FramePattern {
  std::string before, after;  ///< the path before and after the number, with "%%" as "%"
  int digits = 0;  ///< minimum number of digits; 0: no place for a number, `before` is the path
  bool has_number() const { return digits > 0; }
  bool empty() const { return before.empty() && !has_number(); }  ///< names no file
};

/// Parses a pattern. Errors (kUsage): a single '#', two places for the number, a place in a
/// folder's name, or no file name.
Result<FramePattern> parse_pattern(const std::string& text);

/// Parses the file name as a pattern, but takes the folder's name literally. Errors: those of
/// parse_pattern().
Result<FramePattern> parse_file_pattern(const std::filesystem::path& file);

/// Inserts ".####" before the extension if the pattern has no place for a number, so that it can
/// name several frames.
FramePattern add_number(FramePattern pattern);

/// Returns the path of a frame's file. It is the same for all frames if the pattern has no place
/// for a number.
std::filesystem::path frame_path(const FramePattern& pattern, int frame);
/// Replaces the extension of the pattern, or appends one; `extension` begins with a dot.
FramePattern with_extension(FramePattern pattern, const std::string& extension);

/// Lists the frames on disk that match the pattern, ascending. Errors (kInput): unreadable folder.
Result<std::vector<int>> existing_frames(const FramePattern& pattern);

}  // namespace polymorph
