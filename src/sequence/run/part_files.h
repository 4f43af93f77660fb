// Files of parts: which samples of which frame an EXR file has, by its header.
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

/// Contents of a frame's file by its header.
struct FrameHeader {
  /// Equal for parts of one picture: PreparedScene's frame_hash(); empty: not polymorph's.
  std::string identity;
  int frame = 0;
  std::optional<SampleRange> part;  ///< empty: a whole frame
};
FrameHeader parse_frame_header(std::span<const Attribute> attributes);

/// Header of a file; empty for one that is no EXR. Errors (kInput): it cannot be read.
Result<FrameHeader> read_frame_header(const std::filesystem::path& file);

/// A file that has some of a frame's samples.
struct PartFile {
  std::filesystem::path path;
  FrameHeader header;  ///< header whose `part` is set
};

/// Lists the parts among the EXR files of a folder, by name; others are left out. Errors (kInput):
/// an unreadable folder.
Result<std::vector<PartFile>> list_parts(const std::filesystem::path& folder);

/// Lists the parts in a folder and in the folders in it, by name. Unreadable folders have none.
std::vector<PartFile> find_parts(const std::filesystem::path& folder);

/// The ranges of samples as few and as long as can be: "0-31, 48-63".
std::string format_samples(std::span<const SampleRange> ranges);
/// Joins ranges that follow each other or overlap, in ascending order.
std::vector<SampleRange> join_ranges(std::vector<SampleRange> ranges);
/// Lists the samples that joined ranges lack of a picture of `total` samples.
std::vector<SampleRange> missing_ranges(std::span<const SampleRange> joined, int total);

}  // namespace polymorph
