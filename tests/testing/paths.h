// Paths of the source tree and the built program.
#pragma once

#include <filesystem>

namespace polymorph {

/// Returns the checkout's root.
std::filesystem::path source_dir();

/// Returns the path of the built program.
std::filesystem::path program_path();

/// Returns the cache folder in which tests share balls, distances and paces (leg/pacing.h).
/// scripts/test empties it first.
std::filesystem::path shared_cache();

}  // namespace polymorph
