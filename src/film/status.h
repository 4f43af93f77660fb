// State of frames on disk: missing, current or stale.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/frames.h"
#include "base/program_identity.h"
#include "base/result.h"
#include "image/display_view.h"
#include "render/sample_range.h"
#include "scene/scene.h"

namespace polymorph {

/// State of a frame's file.
enum class FileState {
  kCurrent,     ///< its header has the frame's number, hash and settings
  kMissing,     ///< there is no such file
  kStale,       ///< made from another scene, with other settings or by another build
  kUnreadable,  ///< no complete image
  kPart,        ///< has some of the frame's samples, but not those that are expected
};

/// Hashes all inputs of the scene's frames except the program: content_hash()
/// (assets/content_hash.h) with an empty `program`. Reads the scene's files. Errors: kInput.
Result<std::string> source_hash(const Scene& scene);

/// Hashes and settings that make the files of the requested frames current.
struct ExpectedHashes {
  std::string scene;                ///< SequenceHashes::scene
  std::vector<std::string> frames;  ///< frame_hash() of each requested frame
  OutputSettings output;            ///< settings that files must have been made with
  DisplayView view;                 ///< view of PNG files; set by the caller
};
/// Computes the hashes of `frames`. Errors: as source_hash().
Result<ExpectedHashes> expected_hashes(const Scene& scene, std::span<const int> frames);

/// Properties that make the file of one frame current.
struct ExpectedFrame {
  std::string hash;  ///< frame_hash()
  int frame = 0;
  OutputSettings output;  ///< a PNG's bits per channel; an EXR's colour space and layout
  DisplayView view = {};  ///< view of a PNG
  std::optional<SampleRange> part = {};  ///< samples of a part; empty: the whole frame
};

/// Determines the state of a file by its header. Reads the whole file to find truncated ones.
FileState file_state(const std::filesystem::path& file, const ExpectedFrame& expected);

/// Determines the state of each frame. If several files of a frame are not current, the state of
/// the last one (EXR, PNG) counts.
std::vector<FileState> frame_states(const FrameFiles& files, std::span<const int> frames,
                                    const ExpectedHashes& expected);

/// Formats ascending frames as "1-4,7,9-12".
std::string format_frame_list(std::span<const int> frames);

}  // namespace polymorph
