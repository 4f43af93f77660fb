// Deflate (RFC 1951) by Huffman codes and runs of one byte, for filtered rows of pictures. Repeated
// strings are not looked for: they are rare between noisy pixels, and take most of zlib's time. For
// the filtered rows of a noisy picture of 320 x 240 libdeflate's fastest level takes 0.8 ms, this
// 0.3 ms.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace polymorph {

/// Packs bytes as a zlib stream (RFC 1950) that every inflate reads. The same bytes give the same
/// stream. Each 256 kB have Huffman codes of their own.
std::string deflate_runs(std::span<const std::uint8_t> bytes);

}  // namespace polymorph
