// SHA-256 of numbers, for tests of results that must be the same on every processor.
#pragma once

#include <nettle/sha2.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace polymorph {

/// Hashes numbers; hex() returns the first 8 bytes of their SHA-256, in 16 digits.
class Digest {
 public:
  Digest() { sha256_init(&state_); }
  template <class T>
  void add(const std::vector<T>& values) {
    sha256_update(&state_, values.size() * sizeof(T),
                  reinterpret_cast<const std::uint8_t*>(values.data()));
  }
  std::string hex() {
    std::array<std::uint8_t, 8> bytes;
    sha256_digest(&state_, bytes.size(), bytes.data());
    std::string text;
    for (const std::uint8_t byte : bytes) {
      char digits[3];
      std::snprintf(digits, sizeof digits, "%02x", byte);
      text += digits;
    }
    return text;
  }

 private:
  sha256_ctx state_;
};

}  // namespace polymorph
