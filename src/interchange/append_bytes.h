#pragma once

#include <string>

namespace polymorph {

/// Appends a value's bytes as they lie in memory.
template <class T>
void append_bytes(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace polymorph
