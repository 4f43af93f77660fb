// Reproduction of a frame from its own header: the same scene, files and program give the same
// bits.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace polymorph {

struct ReproduceSettings {
  std::filesystem::path models = ".";  ///< folder that the names of files in the header begin at
  std::string device = "auto";
  std::size_t max_memory = 0;          ///< bytes that the run may take; 0 = no limit
  std::filesystem::path cache_folder;  ///< empty: none
};

struct Reproduction {
  int frame = 0;
  std::string program;               ///< version and identity of the build that the header names
  bool same_program = false;         ///< it is this build
  std::vector<std::string> missing;  ///< a line for each file that is not there
  std::vector<std::string> changed;  ///< a line for each file that is not the frame's
  bool same_pixels = false, same_bytes = false;
  std::string difference;  ///< difference of the pixels, in words
  std::string bytes;       ///< the frame as rendered now, as a file; empty: it was not rendered
};

/// Renders a frame again from the scene in its header, with the files that it names. Files are
/// looked at first: where one is missing or differs, nothing is rendered. Compares pixels to the
/// bit, and the file's bytes with those that this program would write. Errors: kInput (no image, no
/// usable provenance, a scene that cannot be rendered), kResource.
Result<Reproduction> reproduce_frame(const std::filesystem::path& file,
                                     const ReproduceSettings& settings);

}  // namespace polymorph
