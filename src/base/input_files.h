// The files that this run has read so far, for commands that watch them.
#pragma once

#include <filesystem>
#include <vector>

namespace polymorph {

/// Absolute names of all files that were told to remember_input() (base/file.h) while the
/// InputGuard lives, each once, in order.
std::vector<std::filesystem::path> input_files();

}  // namespace polymorph
