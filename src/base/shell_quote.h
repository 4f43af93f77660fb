// Quoting for command lines of a POSIX shell.
#pragma once

#include <string>

namespace polymorph {

/// Quotes a word if a POSIX shell would not read it literally; otherwise returns it unchanged.
std::string quote_for_shell(const std::string& word);

}  // namespace polymorph
