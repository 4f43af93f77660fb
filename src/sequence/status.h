// Which frames of a sequence are there and current, whoever rendered them.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/program_identity.h"
#include "base/result.h"
#include "scene/scene.h"
#include "sequence/frames.h"

namespace polymorph {

enum class FileState {
  kWhole,       ///< its header names this frame of this scene
  kMissing,     ///< there is no such file
  kStale,       ///< of another scene, of other settings or of another build of the program
  kUnreadable,  ///< no whole image
};

/// The hash in the headers of the scene's frames (content_hash()), or, without a program, that of
/// what they are made of. Loads the models; makes no balls. Errors: kInput.
Result<std::string> sequence_hash(const Scene& scene,
                                  std::string_view program = program_identity());

/// Reads the whole file: a name alone proves nothing. `frame` as in its header.
FileState file_state(const std::filesystem::path& file, const std::string& hash, int frame);

/// The states of these frames' files, in their order.
std::vector<FileState> file_states(const FramePattern& pattern, std::span<const int> frames,
                                   const std::string& hash);

/// "1-4,7,9-12" of ascending frames.
std::string frame_list(std::span<const int> frames);

}  // namespace polymorph
