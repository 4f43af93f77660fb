// Merging of parts (files with some of a frame's samples) into frames.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/frame_pattern.h"
#include "base/result.h"
#include "render/sample_range.h"

namespace polymorph {

/// The header attribute of a draft (a picture that lacks samples). It states the samples that the
/// picture has: "0-15 of 64".
inline constexpr const char* kDraftAttribute = "polymorph/draft";

struct MergeSettings {
  std::vector<std::string> inputs;  ///< EXR files, patterns of EXR files, and folders
  std::string output;               ///< an EXR file, or a pattern of EXR files
  bool overwrite = false;
  bool partial = false;  ///< if samples are missing, merge the parts into a larger part
  bool draft = false;    ///< if samples are missing, merge the parts into a draft
  std::string command;   ///< command line that the image headers state
};

/// The merging of one frame's parts into one file.
struct FrameMerge {
  int frame = 0;
  SampleRange samples;  ///< range from the first to the last sample of all parts
  std::vector<std::filesystem::path> parts;  ///< parts in the order of their samples
  std::vector<SampleRange> ranges;           ///< samples of all parts: disjoint, ascending
  bool is_draft = false;                     ///< the output is a picture that lacks samples
  std::filesystem::path output;
};

/// Plans the merging of all frames, in ascending order, from the files' headers only. Errors:
/// kUsage for an output that is no EXR; kInput for a file that is no part, for parts of different
/// pictures of one frame, for samples in two parts, and for missing samples that neither `partial`
/// nor `draft` allows; kOutput for an output that may not be written.
Result<std::vector<FrameMerge>> plan_merge(const MergeSettings& settings);

/// Merges one frame and writes it; its header gets `command`. Errors: kInput if a part is broken;
/// kOutput.
Status merge_frame(const FrameMerge& merge, const std::string& command);

}  // namespace polymorph
