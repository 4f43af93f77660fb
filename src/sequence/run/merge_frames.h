// Merging of parts to frames: which files belong together, and what is missing among them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/frame_pattern.h"
#include "base/result.h"
#include "render/sample_range.h"

namespace polymorph {

/// The attribute of a picture that lacks samples: "0-15 of 64", those that it has.
inline constexpr const char* kDraftAttribute = "polymorph/draft";

struct MergeSettings {
  std::vector<std::string> inputs;  ///< EXR files, patterns of them, and folders
  std::string output;               ///< an EXR file, or a pattern
  bool overwrite = false;
  bool partial = false;  ///< parts that are not the whole frame become a larger part
  bool draft = false;    ///< they become a picture of the samples that there are
  std::string command;   ///< command line that the image headers state
};

/// One file to write.
struct FrameMerge {
  int frame = 0;
  SampleRange samples;                       ///< samples of all parts together
  std::vector<std::filesystem::path> parts;  ///< parts in the order of their samples
  std::vector<SampleRange> ranges;           ///< samples of the parts, joined
  bool is_draft = false;                     ///< a picture that lacks samples
  std::filesystem::path output;
};

/// Plans the merging of all frames, ascending, from the files' headers alone. Errors: kUsage for an
/// output that is no EXR; kInput for a file that is no part, parts of different pictures of a
/// frame, samples that two of them have or that are missing; kOutput for an output that may not be
/// written.
Result<std::vector<FrameMerge>> plan_merge(const MergeSettings& settings);

/// Merges one frame and writes it. Errors: kInput (a part is broken), kOutput.
Status merge_frame(const FrameMerge& merge, const std::string& command);

}  // namespace polymorph
