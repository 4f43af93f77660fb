// Paths of the source tree and the built program.
#pragma once

#include <filesystem>

namespace polymorph {

/// The checkout's root.
std::filesystem::path source_dir();

/// The program as built, as users run it.
std::filesystem::path program_path();

/// Balls, distances and paces that tests make are kept for other tests, which need not make them
/// again; scripts/test begins with an empty one.
std::filesystem::path shared_cache();

}  // namespace polymorph
