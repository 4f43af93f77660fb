// State of frames on disk: missing, current or stale, whoever rendered them.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/program_identity.h"
#include "base/result.h"
#include "image/display_view.h"
#include "scene/scene.h"
#include "sequence/run/frames.h"

namespace polymorph {

enum class FileState {
  kWhole,       ///< its header names this frame of this scene
  kMissing,     ///< there is no such file
  kStale,       ///< made from another scene, other settings or by another build of the program
  kUnreadable,  ///< no whole image
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

/// Reads the whole file: a name alone proves nothing. `hash`: frame_hash(), `frame` as in its
/// header; a PNG must have the output's bits per channel and this view, an EXR its colour space,
/// too.
FileState file_state(const std::filesystem::path& file, const std::string& hash, int frame,
                     const OutputSettings& output, const DisplayView& view = {});

/// The states of these frames, in their order; a frame is as good as the worst of its files.
std::vector<FileState> frame_states(const FrameFiles& files, std::span<const int> frames,
                                    const ExpectedHashes& expected);

/// "1-4,7,9-12" of ascending frames.
std::string frame_list(std::span<const int> frames);

}  // namespace polymorph
