// Where the source tree and the built program are.
#pragma once

#include <filesystem>

namespace polymorph {

/// The checkout's root.
std::filesystem::path source_dir();

/// The program as built, as users run it.
std::filesystem::path program_path();

}  // namespace polymorph
