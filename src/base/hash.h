// Content hashes: cache keys, mesh digests, decoded-pixel digests. They are XXH3-128 as 32 hex
// digits, and not cryptographic.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace polymorph {

/// Accumulates the hash of a sequence of values.
class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  Hasher& add_bytes(const void* data, std::size_t size);
  /// Adds a text and its length, so that "ab", "c" and "a", "bc" differ.
  Hasher& add(std::string_view text);
  /// Adds a number, or the length and the values of an array. The values must have no padding.
  template <class T>
  requires std::is_arithmetic_v<T> Hasher& add(T value) { return add_bytes(&value, sizeof value); }
  template <class T>
  requires std::is_trivially_copyable_v<T> Hasher& add(std::span<const T> values) {
    add(values.size());
    return add_bytes(values.data(), values.size_bytes());
  }
  /// Returns 32 hex digits for all values added so far.
  std::string hex() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polymorph
