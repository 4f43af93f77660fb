// Files of parts: EXR files with some of a frame's samples, described by their headers.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "image/image.h"
#include "render/sample_range.h"

namespace polymorph {

/// Entries of a file's header that say which frame, and which of its samples, the file holds.
struct FrameHeader {
  /// frame_hash() (sequence/prepare/film_settings.h), equal for all parts of a picture. Empty: the
  /// file was not written by polymorph.
  std::string identity;
  int frame = 0;                    ///< number of the frame; 0: not stated
  std::optional<SampleRange> part;  ///< samples that the file has; empty: all samples
};
/// Reads a FrameHeader from the attributes of an image.
FrameHeader parse_frame_header(std::span<const Attribute> attributes);

/// Reads the header of a file. If the file is no EXR, the result is a default FrameHeader. Errors:
/// kInput if the file cannot be read.
Result<FrameHeader> read_frame_header(const std::filesystem::path& file);

/// A file that has some of a frame's samples.
struct PartFile {
  std::filesystem::path path;
  FrameHeader header;  ///< header whose `part` is set
};

/// Lists the parts among the EXR files of a folder, sorted by name. Skips unreadable files. Errors:
/// kInput for an unreadable folder.
Result<std::vector<PartFile>> list_parts(const std::filesystem::path& folder);

/// Lists the parts in a folder (empty: the current one), then those in its direct subfolders. Both
/// lists are sorted by path. Skips unreadable folders.
std::vector<PartFile> find_parts(const std::filesystem::path& folder);

/// Formats ranges of samples as FIRST-LAST, separated by commas: "0-31, 48-63".
std::string format_samples(std::span<const SampleRange> ranges);
/// Joins adjacent and overlapping ranges; the result is in ascending order.
std::vector<SampleRange> join_ranges(std::vector<SampleRange> ranges);
/// Lists the ranges of a frame's `total` samples that are not in `joined`, in ascending order.
/// `joined`: the result of join_ranges().
std::vector<SampleRange> missing_ranges(std::span<const SampleRange> joined, int total);

}  // namespace polymorph
