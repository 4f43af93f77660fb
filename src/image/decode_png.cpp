#include "image/decode_png.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "image/byte_order.h"
#include "image/color_description.h"
#include "image/image_io.h"
#include "image/png_errors.h"
#include "kernels/large_pages.h"

namespace polymorph {
namespace {

/// The returned image, with the storage that its pointers refer to.
struct PngImage : PmOiioImage {
  PngImage() : PmOiioImage{} {}
  std::string error_text;
  std::vector<png_byte> samples;    ///< samples as libpng delivers them
  std::vector<png_bytep> rows;      ///< the first byte of each row
  std::unique_ptr<float[]> values;  ///< samples of 16 bits in [0, 1]
  std::vector<std::string> texts;   ///< keywords and texts, alternating
  std::vector<PmOiioAttribute> entries;
};

/// The file that libpng reads, and the offset of the next byte.
struct PngSource {
  const std::string& bytes;
  std::size_t at = 0;
};

void read_bytes(png_structp png, png_bytep to, std::size_t size) {
  auto& reader = *static_cast<PngSource*>(png_get_io_ptr(png));
  if (size > reader.bytes.size() - reader.at) png_error(png, "the file ends early");
  std::memcpy(to, reader.bytes.data() + reader.at, size);
  reader.at += size;
}

/// Reads the header and sets up the conversion to grey, grey and alpha, RGB or RGBA, with 8 bits
/// per sample or with 16 in this machine's byte order. Sets `bits` to that number.
void read_header(png_structp png, png_infop info, PngImage& image, int& bits) {
  // The size is checked against the caller's limit instead.
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  static const png_byte kCodingChunk[] = "cICP";  // libpng before 1.6.45 does not know this chunk
  png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_ALWAYS, kCodingChunk, 1);
  png_read_info(png, info);
  png_set_expand(png);
  if (png_get_bit_depth(png, info) == 16) png_set_swap(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  bits = png_get_bit_depth(png, info);
  image.width = static_cast<int>(png_get_image_width(png, info));
  image.height = static_cast<int>(png_get_image_height(png, info));
  image.channels = png_get_channels(png, info);
}

void copy_texts(png_structp png, png_infop info, PngImage& image) {
  png_textp texts = nullptr;
  int count = 0;
  png_get_text(png, info, &texts, &count);
  for (int i = 0; i < count; ++i) {
    image.texts.emplace_back(texts[i].key);
    image.texts.emplace_back(texts[i].text ? texts[i].text : "");
  }
}

/// Reads the orientation from an Exif block, which is a TIFF file; 1 if the block has none.
int exif_orientation(std::span<const png_byte> exif) {
  if (exif.size() < 8) return 1;
  const std::string_view bytes(reinterpret_cast<const char*>(exif.data()), exif.size());
  const auto read_integer = [&](std::size_t at, std::size_t size) {
    return bytes[0] == 'I' ? read_little_endian(bytes, at, size) : read_big_endian(bytes, at, size);
  };
  const std::size_t directory = read_integer(4, 4), count = read_integer(directory, 2);
  for (std::size_t i = 0; i < count && directory + 12 * i + 14 <= exif.size(); ++i) {
    constexpr std::size_t kOrientationTag = 0x0112;
    const std::size_t entry = directory + 2 + 12 * i;  // tag, type, count and value: 12 bytes
    if (read_integer(entry, 2) == kOrientationTag)
      return static_cast<int>(read_integer(entry + 8, 2));
  }
  return 1;
}

/// Formats the coding points of a cICP chunk (ITU-T H.273: primaries, curve, matrix, full range),
/// which overrides all other colour descriptions (PNG, third edition, 4.3); "" if there is no such
/// chunk.
std::string coding_points(png_structp png, png_infop info) {
  png_unknown_chunkp chunks = nullptr;
  const int count = png_get_unknown_chunks(png, info, &chunks);
  for (int i = 0; i < count; ++i) {
    const png_unknown_chunk& chunk = chunks[i];
    if (std::memcmp(chunk.name, "cICP", 4) == 0 && chunk.size == 4)
      return fmt::format("cICP {} {} {} {}", chunk.data[0], chunk.data[1], chunk.data[2],
                         chunk.data[3]);
  }
  return "";
}
/// Coding points of sRGB: primaries of Rec. 709, its curve, no matrix, full range.
constexpr const char* kSrgbCodingPoints = "cICP 1 13 0 1";

/// Adds the coding points, else the ICC profile, else the primaries, unless the file states sRGB.
void add_color_description(png_structp png, png_infop info, PngImage& image) {
  if (std::string points = coding_points(png, info); !points.empty()) {
    if (points == kSrgbCodingPoints) return;
    image.texts.emplace_back(kColorProfileAttribute);
    image.texts.push_back(std::move(points));
    return;
  }
  int intent = 0, method = 0;
  if (png_get_sRGB(png, info, &intent) != 0) return;
  png_charp name = nullptr;
  png_bytep profile = nullptr;
  png_uint_32 size = 0;
  if (png_get_iCCP(png, info, &name, &method, &profile, &size) != 0) {
    image.texts.emplace_back(kColorProfileAttribute);
    image.texts.push_back(describe_profile(profile, size));
    return;
  }
  // libpng states white first, describe_primaries() expects it last.
  double xy[8];
  if (png_get_cHRM(png, info, &xy[6], &xy[7], &xy[0], &xy[1], &xy[2], &xy[3], &xy[4], &xy[5]) == 0)
    return;
  float primaries[8];
  for (int i = 0; i < 8; ++i) primaries[i] = static_cast<float>(xy[i]);
  if (std::string text = describe_primaries(primaries); !text.empty()) {
    image.texts.emplace_back(kColorPrimariesAttribute);
    image.texts.push_back(std::move(text));
  }
}

/// Adds the header entries that change how viewers display the pixels (image_io.h).
void add_display_entries(png_structp png, png_infop info, PngImage& image) {
  const auto add = [&](const char* name, PmOiioAttributeKind kind, int integer, float real) {
    image.entries.push_back({name, kind, nullptr, integer, real});
  };
  double gamma = 0;
  int intent = 0;
  if (coding_points(png, info).empty() && png_get_sRGB(png, info, &intent) == 0 &&
      png_get_gAMA(png, info, &gamma) != 0 && std::abs(gamma - /*sRGB=*/1 / 2.2) > 1e-3)
    add(kGammaAttribute, PM_OIIO_FLOAT, 0, static_cast<float>(gamma));
  add_color_description(png, info, image);
  const float aspect = png_get_pixel_aspect_ratio(png, info);
  if (aspect > 0 && std::abs(aspect - 1) > 0.01f)
    add(kPixelAspectAttribute, PM_OIIO_FLOAT, 0, aspect);
  png_bytep exif = nullptr;
  png_uint_32 size = 0;
  if (png_get_eXIf_1(png, info, &size, &exif) == 0 || !exif) return;
  const int orientation = exif_orientation({exif, size});
  if (orientation != 1) add(kOrientationAttribute, PM_OIIO_INT, orientation, 0);
}

/// libpng's structures, which the destructor frees also after an error.
struct Handles {
  png_structp png = nullptr;
  png_infop info = nullptr;
  ~Handles() { png_destroy_read_struct(&png, &info, nullptr); }
};

/// Reads the header; returns false on an error. Then libpng has called longjmp(), which skips
/// destructors. Therefore no local variable of read_until_pixels(), of read_pixels() or of the
/// functions that they call owns memory. The caller allocates the pixels between the two calls.
bool read_until_pixels(Handles& h, PngImage& image, int& bits) {
  if (setjmp(png_jmpbuf(h.png)) != 0) return false;
  read_header(h.png, h.info, image, bits);
  return true;
}
/// Reads all that follows the header; returns false on an error.
bool read_pixels(Handles& h, PngImage& image) {
  if (setjmp(png_jmpbuf(h.png)) != 0) return false;
  png_read_image(h.png, image.rows.data());
  png_read_end(h.png, h.info);
  return true;
}

/// Converts the first `count` samples, integers of 16 bits, to floats in [0, 1].
void convert_codes(PngImage& image, std::size_t count) {
  constexpr std::int64_t kGrain = 1 << 16;  // values per task
  // Not initialized, so that the threads touch the memory pages first.
  image.values = std::make_unique_for_overwrite<float[]>(count);
  parallel_for(
      static_cast<std::int64_t>(count),
      [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        std::uint16_t code;
        std::memcpy(&code, &image.samples[k * sizeof code], sizeof code);
        image.values[k] = static_cast<float>(code) / 65535.0f;
      },
      kGrain);
}

/// Decodes the file. Sets the size, `codes`, `failure` and the members that own memory;
/// decode_png() sets the rest.
void decode(const std::string& bytes, std::uint64_t max_bytes, PngImage& image) {
  image.failure = PM_OIIO_BROKEN;  // until all is decoded
  PngSource reader{bytes};
  Handles h;
  h.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &image.error_text, store_png_error,
                                 ignore_png_warning);
  h.info = h.png ? png_create_info_struct(h.png) : nullptr;
  if (!h.info) {
    image.error_text = "out of memory";
    return;
  }
  png_set_read_fn(h.png, &reader, read_bytes);
  int bits = 0;
  if (!read_until_pixels(h, image, bits)) return;
  const auto width = static_cast<std::size_t>(image.width),
             height = static_cast<std::size_t>(image.height),
             channels = static_cast<std::size_t>(image.channels);
  // As doubles, the factors cannot overflow.
  if (static_cast<double>(width) * static_cast<double>(height * channels) * sizeof(float) >
      static_cast<double>(max_bytes)) {
    image.failure = PM_OIIO_TOO_LARGE;
    return;
  }
  const std::size_t stride = width * channels * static_cast<std::size_t>(bits / 8);
  image.samples = make_large_vector<png_byte>(stride * height);
  for (std::size_t y = 0; y < height; ++y) image.rows.push_back(&image.samples[y * stride]);
  if (!read_pixels(h, image)) return;
  copy_texts(h.png, h.info, image);
  add_display_entries(h.png, h.info, image);
  if (bits == 16)
    convert_codes(image, width * height * channels);
  else
    image.codes = image.samples.data();
  image.failure = PM_OIIO_GOOD;
}

}  // namespace

DecodedImage decode_png(const std::string& bytes, std::uint64_t max_bytes) {
  static const char* const kGrey[] = {"Y", "A"};
  static const char* const kColors[] = {"R", "G", "B", "A"};
  auto* image = new PngImage;
  DecodedImage result(image, [](PmOiioImage* picture) { delete static_cast<PngImage*>(picture); });
  decode(bytes, max_bytes, *image);
  image->error = image->error_text.c_str();
  image->channel_names = image->channels < 3 ? kGrey : kColors;
  image->pixels = image->values.get();
  image->integer_format = 1;
  image->straight_alpha = 1;
  for (std::size_t i = 0; i + 1 < image->texts.size(); i += 2)
    image->entries.push_back({image->texts[i].c_str(), PM_OIIO_STRING, image->texts[i + 1].c_str(),
                              /*integer=*/0, /*real=*/0});
  image->attribute_count = static_cast<int>(image->entries.size());
  image->attributes = image->entries.data();
  return result;
}

}  // namespace polymorph
