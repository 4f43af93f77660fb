// Bytes packed with zlib and base64, for file headers and pages that can contain text only.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "base/result.h"

namespace polymorph {

/// Decodes base64. Errors (kInput): `text` is no base64.
Result<std::string> decode_base64(std::string_view text);

/// Packs a text or bytes as base64 of zlib data (RFC 1950). `effort`: zlib's level, 1 to 9.
std::string pack_text(std::string_view text, int effort = 9);

/// Unpacks the result of pack_text(); `packed` may be damaged or malicious. Errors (kInput):
/// `packed` is no base64, its zlib data are damaged or incomplete, or the text has more than
/// `limit` bytes.
Result<std::string> unpack_text(std::string_view packed, std::size_t limit);

}  // namespace polymorph
