#include "image/decode_png.h"

#include <png.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

#include "base/parallel.h"

namespace polymorph {
namespace {

/// The image handed out, with the storage that its pointers refer to.
struct PngImage : PmOiioImage {
  PngImage() : PmOiioImage{} {}
  std::string error_text;
  std::vector<png_byte> codes;
  std::vector<png_bytep> rows;
  std::unique_ptr<float[]> values;
  std::vector<std::string> texts;  ///< keyword and text by turns
  std::vector<PmOiioAttribute> entries;
};

struct Reader {
  const std::string& bytes;
  std::size_t at = 0;
  PngImage& image;
};

void read_bytes(png_structp png, png_bytep to, std::size_t size) {
  auto& reader = *static_cast<Reader*>(png_get_io_ptr(png));
  if (size > reader.bytes.size() - reader.at) png_error(png, "the file ends early");
  std::memcpy(to, reader.bytes.data() + reader.at, size);
  reader.at += size;
}

void keep_error(png_structp png, png_const_charp text) {
  static_cast<PngImage*>(png_get_error_ptr(png))->error_text = text;
  png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

/// Grey, grey and alpha, RGB or RGBA, of 8 or 16 bits, the latter as this machine stores them.
void read_header(png_structp png, png_infop info, PngImage& image, int& bits) {
  // The size is checked against the caller's limit instead.
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
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

void take_texts(png_structp png, png_infop info, PngImage& image) {
  png_textp texts = nullptr;
  int count = 0;
  png_get_text(png, info, &texts, &count);
  for (int i = 0; i < count; ++i) {
    image.texts.emplace_back(texts[i].key);
    image.texts.emplace_back(texts[i].text ? texts[i].text : "");
  }
}

/// Frees libpng's structures, however reading ends.
struct Handles {
  png_structp png = nullptr;
  png_infop info = nullptr;
  ~Handles() { png_destroy_read_struct(&png, &info, nullptr); }
};

/// The calls that may jump back here, over frames that own nothing. Room for the pixels is made
/// between the two.
bool read_until_pixels(Handles& h, PngImage& image, int& bits) {
  if (setjmp(png_jmpbuf(h.png)) != 0) return false;
  read_header(h.png, h.info, image, bits);
  return true;
}
bool read_pixels(Handles& h, PngImage& image) {
  if (setjmp(png_jmpbuf(h.png)) != 0) return false;
  png_read_image(h.png, image.rows.data());
  png_read_end(h.png, h.info);
  return true;
}

template <class Code>
void to_values(PngImage& image, std::size_t count, float max_code) {
  constexpr std::int64_t kGrain = 1 << 16;
  // Left unset, so that the threads touch its pages first.
  image.values = std::make_unique_for_overwrite<float[]>(count);
  parallel_for(
      static_cast<std::int64_t>(count),
      [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        Code code;
        std::memcpy(&code, &image.codes[k * sizeof code], sizeof code);
        image.values[k] = static_cast<float>(code) / max_code;
      },
      kGrain);
}

void decode(const std::string& bytes, std::uint64_t max_bytes, PngImage& image) {
  image.failure = PM_OIIO_BROKEN;
  Reader reader{bytes, 0, image};
  Handles h;
  h.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &image, keep_error, ignore_warning);
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
  if (static_cast<double>(width) * static_cast<double>(height * channels) * sizeof(float) >
      static_cast<double>(max_bytes)) {
    image.failure = PM_OIIO_TOO_LARGE;
    return;
  }
  const std::size_t stride = width * channels * static_cast<std::size_t>(bits / 8);
  image.codes.resize(stride * height);
  for (std::size_t y = 0; y < height; ++y) image.rows.push_back(&image.codes[y * stride]);
  if (!read_pixels(h, image)) return;
  take_texts(h.png, h.info, image);
  const std::size_t count = width * height * channels;
  bits == 16 ? to_values<std::uint16_t>(image, count, 65535.0f)
             : to_values<std::uint8_t>(image, count, 255.0f);
  image.failure = PM_OIIO_GOOD;
}

}  // namespace

DecodedImage decode_png(const std::string& bytes, std::uint64_t max_bytes) {
  static const char* const kGrey[] = {"Y", "A"};
  static const char* const kColors[] = {"R", "G", "B", "A"};
  auto* image = new PngImage;
  DecodedImage result(image, [](PmOiioImage* one) { delete static_cast<PngImage*>(one); });
  decode(bytes, max_bytes, *image);
  image->error = image->error_text.c_str();
  image->channel_names = image->channels < 3 ? kGrey : kColors;
  image->pixels = image->values.get();
  image->integer_format = 1;
  image->straight_alpha = 1;
  for (std::size_t i = 0; i + 1 < image->texts.size(); i += 2)
    image->entries.push_back(
        {image->texts[i].c_str(), PM_OIIO_STRING, image->texts[i + 1].c_str(), 0, 0});
  image->attribute_count = static_cast<int>(image->entries.size());
  image->attributes = image->entries.data();
  return result;
}

}  // namespace polymorph
