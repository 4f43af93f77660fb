// SHA-256 (FIPS 180-4, by Nettle), for digests that other programs can check.
#pragma once

#include <nettle/sha2.h>

#include <cstddef>
#include <string>

namespace polymorph {

class Sha256 {
 public:
  Sha256();
  Sha256& add(const void* data, std::size_t size);
  /// Returns 64 hex digits for all data added so far; more may be added afterwards.
  std::string hex() const;

 private:
  sha256_ctx context_;
};

}  // namespace polymorph
