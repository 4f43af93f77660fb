#pragma once

#include <stdexcept>

namespace polymorph {

/// Thrown where a file is JSON but not of the form that it should have; caught where it is read.
struct FormatError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace polymorph
