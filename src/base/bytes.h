// Serialization of values as their bytes in memory.
#pragma once

#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace polymorph {

/// put() appends a value's bytes to a string; take() removes a value from the front of a string,
/// which must be long enough, and returns it.
template <class T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}
template <class T>
T take(std::string_view& bytes) {
  T value;
  std::memcpy(&value, bytes.data(), sizeof value);
  bytes.remove_prefix(sizeof value);
  return value;
}

/// put_array() and take_array() do the same for several values.
template <class T>
void put_array(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}
template <class T>
std::vector<T> take_array(std::string_view& bytes, std::size_t count) {
  std::vector<T> values(count);
  if (count > 0) std::memcpy(values.data(), bytes.data(), count * sizeof(T));
  bytes.remove_prefix(count * sizeof(T));
  return values;
}

}  // namespace polymorph
