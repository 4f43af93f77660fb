#include "base/sha256.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>

namespace polymorph {

Sha256::Sha256() { nettle_sha256_init(&context_); }

Sha256& Sha256::add(const void* data, std::size_t size) {
  nettle_sha256_update(&context_, size, static_cast<const std::uint8_t*>(data));
  return *this;
}

std::string Sha256::hex() const {
  sha256_ctx finished = context_;  // a copy, because nettle_sha256_digest() resets its context
  std::array<std::uint8_t, SHA256_DIGEST_SIZE> digest;
  nettle_sha256_digest(&finished, digest.size(), digest.data());
  return fmt::format("{:02x}", fmt::join(digest, ""));
}

}  // namespace polymorph
