#include "base/sha256.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace polymorph {
namespace {

/// The first 32 bits of the fractions of the cube roots of the first 64 primes, in integer
/// arithmetic.
constexpr std::array<std::uint32_t, 64> round_constants() {
  std::array<std::uint32_t, 64> k{};
  std::size_t count = 0;
  for (unsigned n = 2; count < k.size(); ++n) {
    bool prime = true;
    for (unsigned d = 2; d * d <= n; ++d) prime = prime && n % d != 0;
    if (!prime) continue;
    // The largest x with x^3 <= n 2^96; its low 32 bits are the fraction's. n < 312, x < 2^35.
    unsigned __int128 x = 0;
    for (int bit = 34; bit >= 0; --bit) {
      const unsigned __int128 next = x | (static_cast<unsigned __int128>(1) << bit);
      if (next * next * next <= (static_cast<unsigned __int128>(n) << 96)) x = next;
    }
    k[count++] = static_cast<std::uint32_t>(x);
  }
  return k;
}
constexpr std::array<std::uint32_t, 64> kRound = round_constants();

}  // namespace

void Sha256::block(const std::uint8_t* bytes) {
  std::array<std::uint32_t, 64> w;
  for (std::size_t i = 0; i < 16; ++i)
    w[i] = static_cast<std::uint32_t>(bytes[4 * i]) << 24 |
           static_cast<std::uint32_t>(bytes[4 * i + 1]) << 16 |
           static_cast<std::uint32_t>(bytes[4 * i + 2]) << 8 | bytes[4 * i + 3];
  for (std::size_t i = 16; i < 64; ++i) {
    const std::uint32_t a = w[i - 15], b = w[i - 2];
    w[i] = w[i - 16] + w[i - 7] + (std::rotr(a, 7) ^ std::rotr(a, 18) ^ (a >> 3)) +
           (std::rotr(b, 17) ^ std::rotr(b, 19) ^ (b >> 10));
  }
  std::array<std::uint32_t, 8> s = state_;
  for (std::size_t i = 0; i < 64; ++i) {
    const std::uint32_t t = s[7] +
                            (std::rotr(s[4], 6) ^ std::rotr(s[4], 11) ^ std::rotr(s[4], 25)) +
                            ((s[4] & s[5]) ^ (~s[4] & s[6])) + kRound[i] + w[i];
    const std::uint32_t u = (std::rotr(s[0], 2) ^ std::rotr(s[0], 13) ^ std::rotr(s[0], 22)) +
                            ((s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]));
    std::copy_backward(s.begin(), s.end() - 1, s.end());
    s[4] += t;
    s[0] = t + u;
  }
  for (std::size_t i = 0; i < 8; ++i) state_[i] += s[i];
}

Sha256& Sha256::add(const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  while (size > 0) {
    const std::size_t at = size_ % 64, part = std::min(size, 64 - at);
    std::memcpy(rest_.data() + at, bytes, part);
    bytes += part;
    size -= part;
    size_ += part;
    if (size_ % 64 == 0) block(rest_.data());
  }
  return *this;
}

std::string Sha256::hex() const {
  Sha256 last = *this;
  const std::uint64_t bits = size_ * 8;
  const std::uint8_t one = 0x80, zero = 0;
  last.add(&one, 1);
  while (last.size_ % 64 != 56) last.add(&zero, 1);
  std::array<std::uint8_t, 8> length;
  for (int i = 0; i < 8; ++i) length[i] = static_cast<std::uint8_t>(bits >> (56 - 8 * i));
  last.add(length.data(), length.size());
  std::string text;
  for (const std::uint32_t word : last.state_)
    for (int shift = 28; shift >= 0; shift -= 4) text += "0123456789abcdef"[word >> shift & 15];
  return text;
}

}  // namespace polymorph
