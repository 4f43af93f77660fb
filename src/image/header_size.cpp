#include "image/header_size.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "image/byte_order.h"
#include "image/check_tiff.h"
#include "image/exr_header.h"

namespace polymorph {
namespace {

using namespace std::string_view_literals;

/// Reads integers of a file; a value beyond its end is 0.
struct Numbers {
  std::string_view bytes;

  double read_big_endian(std::size_t at, std::size_t size) const {
    return static_cast<double>(polymorph::read_big_endian(bytes, at, size));
  }
  double read_little_endian(std::size_t at, std::size_t size) const {
    return static_cast<double>(polymorph::read_little_endian(bytes, at, size));
  }
  /// Reads a signed integer of 4 bytes.
  double little_endian_signed(std::size_t at) const {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(read_little_endian(at, 4)));
  }
};

/// Reads the IHDR chunk, which is the first (PNG 11.2.1). Palettes are expanded to 4 channels.
std::optional<HeaderSize> png_size(Numbers in) {
  const double color_type = in.read_big_endian(25, 1);
  const bool grey = color_type == 0, grey_alpha = color_type == 4, rgb = color_type == 2;
  return HeaderSize{in.read_big_endian(16, 4), in.read_big_endian(20, 4),
                    grey         ? 1.0
                    : grey_alpha ? 2.0
                    : rgb        ? 3.0
                                 : 4.0};
}

/// Finds the largest frame header among the marker segments before the first scan (JPEG B.2.2).
std::optional<HeaderSize> jpeg_size(Numbers in) {
  std::optional<HeaderSize> largest;
  for (std::size_t at = 2; at + 9 < in.bytes.size();) {
    if (in.read_big_endian(at, 1) != 0xff) return largest;
    const auto marker = static_cast<int>(in.read_big_endian(at + 1, 1));
    if (marker == 0xff) {  // a fill byte
      ++at;
      continue;
    }
    if (marker == 0xda) return largest;  // the start of a scan
    // Markers 0xc0 to 0xcf begin frames, except those of tables (c4, cc) and the reserved c8.
    const bool is_frame =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (is_frame) {  // height, width and number of components at 5, 7 and 9
      const HeaderSize size{in.read_big_endian(at + 7, 2), in.read_big_endian(at + 5, 2),
                            in.read_big_endian(at + 9, 1)};
      if (!largest || size.width * size.height > largest->width * largest->height) largest = size;
    }
    at += 2 + static_cast<std::size_t>(std::max(2.0, in.read_big_endian(at + 2, 2)));
  }
  return largest;
}

/// Reads the largest width and height of windows and tiles. Sums the channels of all parts, because
/// decoding joins the parts.
std::optional<HeaderSize> exr_size(Numbers in) {
  const bool multipart = (static_cast<unsigned>(in.read_little_endian(5, 1)) & 0x10u) != 0;
  HeaderSize size{0, 0, 1};
  double channels = 0;
  std::size_t at = kExrHeaderBegin;
  while (const auto entry = take_exr_entry(in.bytes, at)) {
    const auto& [name, type, begin, length] = *entry;
    // A second empty name ends the header of the file.
    if (name.empty() && (!multipart || (at < in.bytes.size() && in.bytes[at] == '\0'))) break;
    if (type == "box2i" && (name == "dataWindow" || name == "displayWindow")) {
      // A box is min x, min y, max x and max y.
      size.width = std::max(
          size.width, in.little_endian_signed(begin + 8) - in.little_endian_signed(begin) + 1);
      size.height = std::max(size.height, in.little_endian_signed(begin + 12) -
                                              in.little_endian_signed(begin + 4) + 1);
    }
    if (type == "tiledesc") {
      size.width = std::max(size.width, in.read_little_endian(begin, 4));
      size.height = std::max(size.height, in.read_little_endian(begin + 4, 4));
    }
    if (type == "chlist") {
      for (std::size_t channel = begin; channel < begin + length && in.bytes[channel] != '\0';) {
        channel = in.bytes.find('\0', channel);
        if (channel == std::string_view::npos) break;
        channel += 17;  // the name's zero byte; 16 bytes of type, linearity and sampling rates
        ++channels;
      }
      size.channels = std::max(size.channels, channels);
    }
  }
  if (size.width == 0) return std::nullopt;
  return size;
}

/// Reads the first chunk (WebP container): the size of the canvas (VP8X) or of the picture.
std::optional<HeaderSize> webp_size(Numbers in) {
  const std::string_view chunk = in.bytes.substr(std::min<std::size_t>(12, in.bytes.size()), 4);
  if (chunk == "VP8X")
    return HeaderSize{in.read_little_endian(24, 3) + 1, in.read_little_endian(27, 3) + 1};
  if (chunk == "VP8 ")  // sides of 14 bits
    return HeaderSize{std::fmod(in.read_little_endian(26, 2), 16384),
                      std::fmod(in.read_little_endian(28, 2), 16384)};
  if (chunk != "VP8L") return std::nullopt;
  // The sides less 1, in 14 bits each.
  const auto bits = static_cast<std::uint32_t>(in.read_little_endian(21, 4));
  return HeaderSize{(bits & 0x3fff) + 1.0, (bits >> 14 & 0x3fff) + 1.0};
}

/// Reads the image header box of a JP2, or the size marker at the beginning of a bare code stream.
std::optional<HeaderSize> jpeg2000_size(Numbers in) {
  if (in.bytes.starts_with("\xff\x4f"sv))
    return HeaderSize{in.read_big_endian(8, 4), in.read_big_endian(12, 4)};
  const std::size_t box = in.bytes.find("ihdr"sv);
  if (box == std::string_view::npos) return std::nullopt;
  return HeaderSize{in.read_big_endian(box + 8, 4), in.read_big_endian(box + 4, 4)};
}

}  // namespace

std::optional<HeaderSize> header_size(std::string_view bytes, std::string_view format) {
  const Numbers in{bytes};
  if (format == "png") return png_size(in);
  if (format == "jpeg") return jpeg_size(in);
  if (format == "openexr") return exr_size(in);
  if (format == "gif") return HeaderSize{in.read_little_endian(6, 2), in.read_little_endian(8, 2)};
  if (format == "webp") return webp_size(in);
  if (format == "jpeg2000") return jpeg2000_size(in);
  if (format != "tiff") return std::nullopt;
  const TiffSize size = tiff_size(bytes);
  return HeaderSize{size.width, size.height, size.channels};
}

}  // namespace polymorph
