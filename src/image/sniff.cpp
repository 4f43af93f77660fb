#include "image/sniff.h"

#include <zlib.h>

#include <cstdint>

#include "image/check_tiff.h"

namespace polymorph {
namespace {

using namespace std::string_view_literals;

struct Magic {
  std::string_view bytes;
  const char* name;
};

constexpr Magic kReadable[] = {
    {"\x89PNG\r\n\x1a\n"sv, "png"},
    {"\xff\xd8\xff"sv, "jpeg"},
    {"II*\0"sv, "tiff"},
    {"MM\0*"sv, "tiff"},
    {"II+\0"sv, "tiff"},
    {"MM\0+"sv, "tiff"},
    {"\x76\x2f\x31\x01"sv, "openexr"},
    {"#?RADIANCE"sv, "hdr"},
    {"#?RGBE"sv, "hdr"},
};

constexpr Magic kKnown[] = {
    {"GIF8"sv, "a GIF"},
    {"BM"sv, "a BMP"},
    {"8BPS"sv, "a Photoshop file"},

    {"RIFF"sv, "a WebP or other RIFF file"},
    {"DDS "sv, "a DDS texture"},
    {"%PDF"sv, "a PDF"},
    {"<svg"sv, "an SVG"},
    {"<?xml"sv, "an XML file"},
    {"\0\0\0\x0cjP"sv, "a JPEG 2000 file"},
};

std::uint32_t big_endian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i)
    value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

std::uint32_t little_endian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

/// The chunks up to IEND. libpng would print to standard error about what is found here.
Status check_png(std::string_view bytes) {
  std::size_t at = 8;
  while (true) {
    if (bytes.size() - at < 12) return make_error(ErrorCode::kInput, "the PNG is truncated");
    const std::size_t length = big_endian(bytes, at);
    if (length > bytes.size() - at - 12)
      return make_error(ErrorCode::kInput, "the PNG is truncated");
    const std::string_view body = bytes.substr(at + 4, length + 4);
    const auto sum =
        crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    if (sum != big_endian(bytes, at + 8 + length))
      return make_error(ErrorCode::kInput, "the PNG is damaged: wrong checksum at byte {}", at);
    if (body.substr(0, 4) == "IEND") return Ok{};
    at += length + 12;
  }
}

/// libjpeg fills the missing part of a cut file with grey and calls it good. Byte stuffing keeps
/// both markers out of the coded data, so an end must follow the last start of a scan.
Status check_jpeg(std::string_view bytes) {
  const std::size_t scan = bytes.rfind("\xff\xda"sv);
  const std::size_t end = bytes.rfind("\xff\xd9"sv);
  if (scan == std::string_view::npos || end == std::string_view::npos || end < scan)
    return make_error(ErrorCode::kInput, "the JPEG is truncated");
  return Ok{};
}

/// The attributes of all headers (OpenEXR file layout: name, type, size, value; an empty name ends
/// a header). OpenEXR makes room for what a size says before it reads: damaged files of 660 bytes
/// took up to 2.9 s to be refused.
Status check_exr(std::string_view bytes) {
  const Error truncated =
      make_error(ErrorCode::kInput, "the EXR is truncated or its header is damaged");
  if (bytes.size() < 8) return truncated;
  const bool multipart = (bytes[5] & 0x10) != 0;
  std::size_t at = 8, attributes = 0;
  while (true) {
    const std::size_t name_end = bytes.find('\0', at);
    if (name_end == std::string_view::npos) return truncated;
    if (name_end == at) {
      // After the last part of a multi-part file comes one more empty name.
      if (!multipart || attributes == 0) return Ok{};
      attributes = 0;
      at = name_end + 1;
      continue;
    }
    const std::size_t type_end = bytes.find('\0', name_end + 1);
    if (type_end == std::string_view::npos || bytes.size() - type_end < 5) return truncated;
    const std::size_t size = little_endian(bytes, type_end + 1);
    at = type_end + 5;
    if (size > bytes.size() - at) return truncated;
    at += size;
    ++attributes;
  }
}

const char* guess(std::string_view bytes) {
  for (const Magic& magic : kKnown)
    if (bytes.starts_with(magic.bytes)) return magic.name;
  for (const char c : bytes.substr(0, 64))
    if (static_cast<unsigned char>(c) < 9) return "unknown binary data";
  return "text or unknown data";
}

}  // namespace

Result<std::string> sniff_image_format(std::string_view bytes) {
  if (bytes.empty()) return make_error(ErrorCode::kInput, "the file is empty");
  for (const Magic& magic : kReadable) {
    if (!bytes.starts_with(magic.bytes)) continue;
    const std::string name = magic.name;
    if (name == "png") PM_TRY_STATUS(check_png(bytes));
    if (name == "jpeg") PM_TRY_STATUS(check_jpeg(bytes));
    if (name == "openexr") PM_TRY_STATUS(check_exr(bytes));
    if (name == "tiff") PM_TRY_STATUS(check_tiff(bytes));
    return name;
  }
  return make_error(
      ErrorCode::kInput,
      "not an image that can be read (by its content it is {}) - give a PNG, JPEG, TIFF, "
      "Radiance HDR or OpenEXR file",
      guess(bytes));
}

}  // namespace polymorph
