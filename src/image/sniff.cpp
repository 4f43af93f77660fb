#include "image/sniff.h"

#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>

#include "image/byte_order.h"
#include "image/check_tiff.h"
#include "image/exr_header.h"
#include "image/header_size.h"

namespace polymorph {
namespace {

using namespace std::string_view_literals;

/// First bytes of the files of a format, and the format's name.
struct Magic {
  std::string_view bytes;
  const char* name;
};

/// Formats that can be read, with OpenImageIO's names of their readers.
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
    {"BM"sv, "bmp"},
    {"GIF87a"sv, "gif"},
    {"GIF89a"sv, "gif"},
    {"8BPS"sv, "psd"},
    {"DDS "sv, "dds"},
    {"\0\0\0\x0cjP  \r\n\x87\n"sv, "jpeg2000"},
    {"\xff\x4f\xff\x51"sv, "jpeg2000"},
};

/// Other formats, with the names that messages give them.
constexpr Magic kUnreadable[] = {
    {"RIFF"sv, "a RIFF file, but no WebP"},
    {"%PDF"sv, "a PDF"},
    {"<svg"sv, "an SVG"},
    {"<?xml"sv, "an XML file"},
    {"PK\x03\x04"sv, "a ZIP archive"},
    {"\xabKTX"sv, "a KTX texture"},
};

/// Checks the chunks up to IEND, because libpng would print their defects to standard error.
Status check_png(std::string_view bytes) {
  std::size_t at = 8;
  while (true) {  // a chunk consists of length, type, data and checksum
    if (bytes.size() - at < 12) return make_error(ErrorCode::kInput, "the PNG is truncated");
    const std::size_t length = read_big_endian(bytes, at, 4);
    if (length > bytes.size() - at - 12)
      return make_error(ErrorCode::kInput, "the PNG is truncated");
    const std::string_view body = bytes.substr(at + 4, length + 4);  // type and data
    const auto checksum =
        crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    if (checksum != read_big_endian(bytes, at + 8 + length, 4))
      return make_error(ErrorCode::kInput, "the PNG is damaged: wrong checksum at byte {}", at);
    if (body.substr(0, 4) == "IEND") return Ok{};
    at += length + 12;
  }
}

/// Checks that the end marker follows the last start of a scan. Byte stuffing keeps both markers
/// out of the coded data. libjpeg would fill the missing part of a truncated file with grey and
/// report success.
Status check_jpeg(std::string_view bytes) {
  const std::size_t scan = bytes.rfind("\xff\xda"sv);
  const std::size_t end = bytes.rfind("\xff\xd9"sv);
  if (scan == std::string_view::npos || end == std::string_view::npos || end < scan)
    return make_error(ErrorCode::kInput, "the JPEG is truncated");
  return Ok{};
}

/// Checks the sizes of the attributes of all headers. OpenEXR allocates memory for a value before
/// it reads the value: it took up to 2.9 s to reject damaged files of 660 bytes.
Status check_exr(std::string_view bytes) {
  const Error truncated =
      make_error(ErrorCode::kInput, "the EXR is truncated or its header is damaged");
  if (bytes.size() < kExrHeaderBegin) return truncated;
  const bool multipart = (bytes[5] & 0x10) != 0;
  std::size_t at = kExrHeaderBegin, attributes = 0;
  while (const auto entry = take_exr_entry(bytes, at)) {
    // One more empty name follows the last part of a multi-part file.
    if (entry->name.empty() && (!multipart || attributes == 0)) return Ok{};
    attributes = entry->name.empty() ? 0 : attributes + 1;
  }
  return truncated;
}

/// Reads a little-endian integer of 2 bytes.
std::size_t word_at(std::string_view bytes, std::size_t at) {
  return read_little_endian(bytes, at, 2);
}

/// Checks the header and that all rows of pixels are there.
Status check_bmp(std::string_view bytes) {
  // A file header of 14 bytes and a picture header, of 40 bytes or more except in OS/2.
  if (bytes.size() < 54) return make_error(ErrorCode::kInput, "the BMP is truncated");
  const bool is_os2 = read_little_endian(bytes, 14, 4) < 40;  // OS/2's header has sizes of 16 bits
  const double width = is_os2 ? static_cast<double>(word_at(bytes, 18))
                              : static_cast<std::int32_t>(read_little_endian(bytes, 18, 4));
  // A negative height means that the rows are stored from the top.
  const double height =
      is_os2 ? static_cast<double>(word_at(bytes, 20))
             : std::abs(1.0 * static_cast<std::int32_t>(read_little_endian(bytes, 22, 4)));
  const auto bits = static_cast<double>(word_at(bytes, is_os2 ? 24 : 28));
  const std::uint64_t compression = is_os2 ? 0 : read_little_endian(bytes, 30, 4);
  // OpenImageIO 2.4 writes out of bounds for runs that extend beyond the picture.
  if (compression == 1 || compression == 2)
    return make_error(ErrorCode::kInput, "run-length encoded BMPs are not read - save it as a PNG");
  if (!(width >= 1) || !(height >= 1) || bits < 1 || bits > 32)
    return make_error(ErrorCode::kInput, "the BMP's header is damaged");
  const double row = std::floor((width * bits + 31) / 32) * 4;  // bytes, a multiple of 4
  if (static_cast<double>(read_little_endian(bytes, 10, 4)) + row * height >
      static_cast<double>(bytes.size()))
    return make_error(ErrorCode::kInput, "the BMP is truncated");
  return Ok{};
}

constexpr std::string_view kTargaFooter = "TRUEVISION-XFILE.\0"sv;

/// Tests whether the header can be that of a Targa, a format without a magic number.
bool is_like_targa(std::string_view bytes) {
  if (bytes.size() < 18) return false;
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
  // map: 1 if there is a colour map; type: 1 colour-mapped, 2 true colour, 3 grey, each + 8 if
  // run-length encoded; bits per pixel. Width and height stand at 12 and 14.
  const int map = byte(1), type = byte(2), bits = byte(16);
  const bool mapped = type == 1 || type == 9, grey = type == 3 || type == 11;
  if (!(mapped || grey || type == 2 || type == 10) || map > 1 || (mapped && map == 0)) return false;
  if (word_at(bytes, 12) == 0 || word_at(bytes, 14) == 0) return false;
  if (mapped) return bits == 8;
  return grey ? bits == 8 || bits == 16 : bits == 15 || bits == 16 || bits == 24 || bits == 32;
}

/// Tests whether all indices of run-length encoded pixels are below `colors`. The first byte of a
/// packet states its number of pixels less 1 (7 bits) and whether one index stands for them all.
bool run_indices_are_valid(std::string_view runs, std::size_t pixels, std::size_t colors) {
  std::size_t at = 0;
  for (std::size_t pixels_read = 0; pixels_read < pixels;) {
    if (at >= runs.size()) return false;
    const auto packet = static_cast<unsigned char>(runs[at++]);
    const std::size_t count = (packet & 0x7fu) + 1u, stored_indices = packet & 0x80u ? 1 : count;
    if (stored_indices > runs.size() - at) return false;
    for (std::size_t i = 0; i < stored_indices; ++i)
      if (static_cast<unsigned char>(runs[at + i]) >= colors) return false;
    at += stored_indices;
    pixels_read += count;
  }
  return true;
}

/// Checks that all uncompressed pixels are there and that no pixel's index is beyond the colour
/// map, where OpenImageIO 2.4 would read.
Status check_targa(std::string_view bytes) {
  const auto byte = [&](std::size_t at) {
    return static_cast<std::size_t>(static_cast<unsigned char>(bytes[at]));
  };
  // The header of 18 bytes is followed by an identification of byte(0) bytes, by the colour map
  // with byte(7) bits per colour, and by the pixels with byte(16) bits each.
  const std::size_t type = byte(2), colors = byte(1) ? word_at(bytes, 5) : 0;
  const std::size_t begin = 18 + byte(0) + colors * ((byte(7) + 7) / 8);
  const std::size_t pixels = word_at(bytes, 12) * word_at(bytes, 14);
  const std::size_t needed_bytes =
      type < 8 ? pixels * ((byte(16) + 7) / 8) : 0;  // 0: run-length encoded
  if (begin > bytes.size() || needed_bytes > bytes.size() - begin)
    return make_error(ErrorCode::kInput, "the Targa file is truncated");
  if (type != 1 && type != 9) return Ok{};
  const bool has_known_depth = byte(7) == 15 || byte(7) == 16 || byte(7) == 24 || byte(7) == 32;
  const std::string_view indices = bytes.substr(begin);
  const bool indices_are_valid =
      type == 9
          ? run_indices_are_valid(indices, pixels, colors)
          : std::all_of(indices.begin(), indices.begin() + static_cast<std::ptrdiff_t>(pixels),
                        [&](char index) { return static_cast<unsigned char>(index) < colors; });
  // The word at 3 is the first index that the map defines.
  if (has_known_depth && indices_are_valid && word_at(bytes, 3) == 0) return Ok{};
  return make_error(ErrorCode::kInput,
                    "the Targa file's colour map is damaged or unusual - save it as true colour");
}

/// Tests whether a name ends in `suffix`, which is in lower case. Ignores the case of the name.
bool has_suffix(std::string_view name, std::string_view suffix) {
  return name.size() >= suffix.size() &&
         std::equal(
             suffix.begin(), suffix.end(), name.end() - static_cast<std::ptrdiff_t>(suffix.size()),
             [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
}

/// Detects the format by its magic number; "" if unknown.
std::string detect_format(std::string_view bytes) {
  for (const Magic& magic : kReadable)
    if (bytes.starts_with(magic.bytes)) return magic.name;
  if (bytes.starts_with("RIFF"sv) && bytes.substr(0, 12).ends_with("WEBP"sv)) return "webp";
  // P1 to P6, PF and Pf are formats of Netpbm.
  if (bytes.size() > 2 && bytes[0] == 'P' &&
      std::string_view("123456Ff").find(bytes[1]) != std::string_view::npos &&
      std::isspace(static_cast<unsigned char>(bytes[2])))
    return "pnm";
  return "";
}

/// Describes the content of a file that cannot be read, for the message.
const char* describe_content(std::string_view bytes) {
  for (const Magic& magic : kUnreadable)
    if (bytes.starts_with(magic.bytes)) return magic.name;
  for (const char c : bytes.substr(0, 64))
    if (static_cast<unsigned char>(c) < 9) return "unknown binary data";  // 9 is a tab
  return "text or unknown data";
}

}  // namespace

Result<std::string> sniff_image_format(std::string_view bytes, std::string_view name) {
  if (bytes.empty()) return make_error(ErrorCode::kInput, "the file is empty");
  std::string format = detect_format(bytes);
  if (format.empty() && is_like_targa(bytes)) format = "targa";
  if (format.empty() && (has_suffix(name, ".tga") || bytes.ends_with(kTargaFooter)))
    return make_error(ErrorCode::kInput, "the Targa file's header is damaged - save it again");
  if (format == "png") PM_TRY_STATUS(check_png(bytes));
  if (format == "jpeg") PM_TRY_STATUS(check_jpeg(bytes));
  if (format == "openexr") PM_TRY_STATUS(check_exr(bytes));
  if (format == "tiff") PM_TRY_STATUS(check_tiff(bytes));
  if (format == "gif" && bytes.size() < 13)
    return make_error(ErrorCode::kInput, "the GIF is truncated");
  if (format == "jpeg2000" && (bytes.size() < 34 || !header_size(bytes, format)))
    return make_error(ErrorCode::kInput, "the JPEG 2000 file is truncated");
  if (format == "bmp") PM_TRY_STATUS(check_bmp(bytes));
  if (format == "targa") PM_TRY_STATUS(check_targa(bytes));
  if (!format.empty()) return format;
  return make_error(
      ErrorCode::kInput,
      "not an image that can be read (by its content it is {}) - give a PNG, JPEG, Targa, BMP, "
      "GIF, WebP, TIFF, Radiance HDR or OpenEXR file",
      describe_content(bytes));
}

}  // namespace polymorph
