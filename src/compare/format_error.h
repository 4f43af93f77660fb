// Exception for JSON files of a wrong form.
#pragma once

#include <stdexcept>

namespace polymorph {

/// Thrown if a file is JSON, but not of the required form; caught where the file is read.
struct FormatError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace polymorph
