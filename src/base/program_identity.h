// Build identity: two builds that may give different pixels have different identities.
#pragma once

#include <string_view>

namespace polymorph {

/// The commit, or a hash of the sources where there is none or they are changed; then compiler,
/// build type and flags. Made by cmake/identity.cmake in every build.
std::string_view program_identity();

}  // namespace polymorph
