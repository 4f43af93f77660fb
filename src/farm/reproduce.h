// Reproduction of a frame: it is rendered again from the scene in its header, and must get the same
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
  std::vector<std::string> missing;  ///< a line for each input file that cannot be read
  std::vector<std::string> changed;  ///< a line for each input file whose digest has changed
  /// Equality of the pixels, and of the bytes of both files; false if nothing was rendered.
  bool same_pixels = false, same_bytes = false;
  std::string difference;  ///< difference of the pixels, in words; empty if there is none
  std::string bytes;       ///< content of the file as rendered now; empty if nothing was rendered
};

/// Renders a frame again from the scene in its header, and compares the pixels and the bytes of
/// both files to the bit. If an input file that the header names is missing or has changed, nothing
/// is rendered. These files' names are relative to the folder `models`. Errors: kInput if `file` is
/// no image, has no usable provenance, or has a scene that cannot be rendered; kResource.
Result<Reproduction> reproduce_frame(const std::filesystem::path& file,
                                     const std::filesystem::path& models,
                                     const Resources& resources);

}  // namespace polymorph
