// Version and build identity: two builds that may give different pixels have different identities.
#pragma once

#include <string_view>

namespace polymorph {

/// Identifies the build: the commit, or a hash of the sources if there is no commit or they are
/// modified; then compiler, build type and flags. cmake/identity.cmake updates it in every build.
std::string_view program_identity();

/// The version of the program, as "1.2.3", from project() in CMakeLists.txt.
std::string_view program_version();

}  // namespace polymorph
