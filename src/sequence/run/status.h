// State of frames on disk: missing, current or stale, whoever rendered them.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/program_identity.h"
#include "base/result.h"
#include "image/display_view.h"
#include "render/sample_range.h"
#include "scene/scene.h"
#include "sequence/run/frames.h"

namespace polymorph {

enum class FileState {
  kWhole,       ///< its header names this frame of this scene
  kMissing,     ///< there is no such file
  kStale,       ///< made from another scene, other settings or by another build of the program
  kUnreadable,  ///< no whole image
  kPart,        ///< some of the frame's samples, or others than were asked for
};

/// The hash of all that the scene's frames are made of, but the program. Loads the models; makes no
/// balls. Errors: kInput.
Result<std::string> source_hash(const Scene& scene);

/// Each frame's hash as its header has it (frame_hash()), and the scene's. Errors: as above.
struct ExpectedHashes {
  std::string scene;
  std::vector<std::string> frames;  ///< names, in the order of the frames asked for
  OutputSettings output;            ///< settings that files must have been made with
  DisplayView view;                 ///< view of PNG files; left to the caller
};
Result<ExpectedHashes> expected_hashes(const Scene& scene, std::span<const int> frames);

/// Demands on a file that is whole.
struct ExpectedFrame {
  std::string hash;  ///< frame_hash()
  int frame = 0;
  OutputSettings output;                 ///< a PNG's bits per channel, an EXR's colour space
  DisplayView view = {};                 ///< view of a PNG
  std::optional<SampleRange> part = {};  ///< these samples, neither more nor fewer
};

/// Reads the whole file: a name alone proves nothing.
FileState file_state(const std::filesystem::path& file, const ExpectedFrame& expected);

/// The states of these frames, in their order; a frame is as good as the worst of its files.
std::vector<FileState> frame_states(const FrameFiles& files, std::span<const int> frames,
                                    const ExpectedHashes& expected);

/// "1-4,7,9-12" of ascending frames.
std::string frame_list(std::span<const int> frames);

}  // namespace polymorph
