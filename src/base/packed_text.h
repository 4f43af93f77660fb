// Packed text: zlib and base64, for headers of files that hold text alone.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "base/result.h"

namespace polymorph {

/// Decodes base64. Errors (kInput): it is none.
Result<std::string> decode_base64(std::string_view text);

/// Packs a text as base64 of zlib data (RFC 1950).
std::string pack_text(std::string_view text);

/// Unpacks what pack_text() wrote, whoever sent it. Errors (kInput): no base64, no whole zlib data,
/// more than `limit` bytes.
Result<std::string> unpack_text(std::string_view packed, std::size_t limit);

}  // namespace polymorph
