// Reproduction of a frame from its own header. The same scene, files and program must give the same
// bits.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "sequence/prepare/engine_scene.h"

namespace polymorph {

/// Comparison of a frame's file with the frame as this program renders it.
struct Reproduction {
  int frame = 0;
  std::string program;               ///< version and identity of the build in the header
  bool same_program = false;         ///< `program` is this build
  std::vector<std::string> missing;  ///< a line for each file that does not exist
  std::vector<std::string> changed;  ///< a line for each file that differs from the header's
  bool same_pixels = false, same_bytes = false;  ///< false if the frame was not rendered
  std::string difference;  ///< difference of the pixels, in words; empty if there is none
  std::string bytes;       ///< file of the frame as rendered now; empty: not rendered
};

/// Renders a frame again from the scene and the files in its header, and compares the pixels to the
/// bit and the file's bytes with those that this program would write. If a file is missing or
/// differs, nothing is rendered. File names in the header are relative to the folder `models`.
/// Errors: kInput for no image, no usable provenance or a scene that cannot be rendered; kResource.
Result<Reproduction> reproduce_frame(const std::filesystem::path& file,
                                     const std::filesystem::path& models,
                                     const Resources& resources);

}  // namespace polymorph
