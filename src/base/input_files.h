// List of the files that this run has read, for commands that watch their inputs.
#pragma once

#include <filesystem>
#include <vector>

namespace polymorph {

/// Lists the absolute names of all files registered with remember_input() (base/file.h) during the
/// lifetime of the InputGuard, sorted and unique.
std::vector<std::filesystem::path> input_files();

}  // namespace polymorph
