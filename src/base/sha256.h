// SHA-256 (FIPS 180-4), for digests that other programs can check.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace polymorph {

class Sha256 {
 public:
  Sha256& add(const void* data, std::size_t size);
  /// 64 hex digits of all that was added; more may be added afterwards.
  std::string hex() const;

 private:
  void block(const std::uint8_t* bytes);

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::uint8_t, 64> rest_{};
  std::uint64_t size_ = 0;
};

}  // namespace polymorph
