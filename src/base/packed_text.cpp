#include "base/packed_text.h"

#include <nettle/base64.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/html_page.h"

namespace polymorph {
namespace {

/// A zlib stream for decompression that ends itself.
struct Inflation {
  z_stream stream = {};
  Inflation() { PM_CHECK(inflateInit(&stream) == Z_OK); }
  ~Inflation() { inflateEnd(&stream); }
  Inflation(const Inflation&) = delete;
  Inflation& operator=(const Inflation&) = delete;
};

}  // namespace

Result<std::string> decode_base64(std::string_view text) {
  std::string bytes(BASE64_DECODE_LENGTH(text.size()), '\0');
  std::size_t size = bytes.size();
  base64_decode_ctx context;
  base64_decode_init(&context);
  if (!base64_decode_update(&context, &size, reinterpret_cast<std::uint8_t*>(bytes.data()),
                            text.size(), text.data()) ||
      !base64_decode_final(&context))
    return make_error(ErrorCode::kInput, "it is no base64");
  bytes.resize(size);
  return bytes;
}

std::string pack_text(std::string_view text, int effort) {
  uLongf size = compressBound(static_cast<uLong>(text.size()));
  std::string bytes(size, '\0');
  PM_CHECK(compress2(reinterpret_cast<Bytef*>(bytes.data()), &size,
                     reinterpret_cast<const Bytef*>(text.data()), static_cast<uLong>(text.size()),
                     effort) == Z_OK);
  bytes.resize(size);
  return base64(bytes);
}

Result<std::string> unpack_text(std::string_view packed, std::size_t limit) {
  PM_TRY(std::string bytes, decode_base64(packed));
  Inflation inflation;
  z_stream& stream = inflation.stream;
  stream.next_in = reinterpret_cast<Bytef*>(bytes.data());
  // The stream's counter has 32 bits; longer data are reported as damaged.
  stream.avail_in = static_cast<uInt>(std::min<std::size_t>(bytes.size(), UINT32_MAX));
  std::string text;
  std::array<char, 1 << 14> buffer;
  int code = Z_OK;
  while (code == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
    stream.avail_out = static_cast<uInt>(buffer.size());
    code = inflate(&stream, Z_NO_FLUSH);
    text.append(buffer.data(), buffer.size() - stream.avail_out);
    if (text.size() > limit)
      return make_error(ErrorCode::kInput, "it unpacks to more than {} bytes", limit);
  }
  if (code != Z_STREAM_END || stream.avail_in > 0)
    return make_error(ErrorCode::kInput, "its zlib data are damaged");
  return text;
}

}  // namespace polymorph
