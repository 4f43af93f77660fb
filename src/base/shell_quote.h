// Words for the command line of a POSIX shell.
#pragma once

#include <string>

namespace polymorph {

/// One word as any POSIX shell reads it: quoted where one of them would see more in it.
std::string shell_quoted(const std::string& word);

}  // namespace polymorph
