// Unsigned integers of files, in either byte order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace polymorph {

/// Reads the integer of `size` bytes (at most 8) at the offset `at`, the most significant byte
/// first. 0 if it does not lie within `bytes`.
inline std::uint64_t read_big_endian(std::string_view bytes, std::size_t at, std::size_t size) {
  if (at > bytes.size() || size > bytes.size() - at) return 0;
  std::uint64_t value = 0;
  for (const char c : bytes.substr(at, size)) value = value << 8 | static_cast<unsigned char>(c);
  return value;
}
/// Reads an integer as read_big_endian() does, but the least significant byte first.
inline std::uint64_t read_little_endian(std::string_view bytes, std::size_t at, std::size_t size) {
  if (at > bytes.size() || size > bytes.size() - at) return 0;
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;)
    value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

}  // namespace polymorph
