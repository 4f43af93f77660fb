#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <span>

#include "base/exact_math.h"
#include "base/parallel.h"
#include "base/random.h"
#include "image/coverage.h"
#include "image/deflate_runs.h"
#include "image/image_io.h"
#include "image/png_errors.h"
#include "image/quantize_srgb.h"
#include "image/rgb_channels.h"
#include "image/srgb.h"

namespace polymorph {
namespace {

/// Keywords and texts of tEXt chunks, in which a PNG holds the image's attributes.
using Texts = std::vector<std::pair<std::string, std::string>>;
Texts make_texts(const std::vector<Attribute>& attributes) {
  constexpr std::size_t kMaxKeyword = 79;  // bytes; PNG's limit
  Texts texts;
  for (const Attribute& attribute : attributes)
    texts.emplace_back(
        attribute.name.substr(0, kMaxKeyword),
        std::visit([](const auto& v) { return fmt::format("{}", v); }, attribute.value));
  return texts;
}

/// Settings of libpng and zlib.
struct Effort {
  int level;     ///< zlib's compression level, 0 to 9
  int strategy;  ///< zlib's strategy
  int filters;   ///< mask of the row filters that libpng tries
};
/// Settings for small files; the smallest result is used. Z_RLE with the average filter is best for
/// noise and fast. Flat pictures, such as text, become smallest by zlib's default strategy, which
/// searches for repeated strings.
constexpr Effort kSmallEfforts[] = {{1, Z_RLE, PNG_FILTER_AVG},
                                    {9, Z_RLE, PNG_ALL_FILTERS},
                                    {9, Z_DEFAULT_STRATEGY, PNG_ALL_FILTERS}};

/// Indices of the image's channels that the PNG stores.
struct Layout {
  std::array<int, 3> color;  ///< red, green and blue
  int alpha = -1;            ///< -1: the PNG has no alpha
  int samples() const { return alpha >= 0 ? 4 : 3; }
};

/// Finds the channels. The PNG has alpha only if a pixel is not opaque.
Result<Layout> find_layout(const Image& image) {
  Layout layout{find_rgb(image), -1};
  if (image.width < 1 || image.height < 1 || !has_rgb(image))
    return make_error(ErrorCode::kInput, "a PNG needs an image with R, G and B channels");
  const int alpha = image.find_channel("A");
  if (alpha < 0) return layout;
  for (auto i = static_cast<std::size_t>(alpha); i < image.pixels.size();
       i += image.channel_count())
    if (!(image.pixels[i] >= 1.0f)) layout.alpha = alpha;
  return layout;
}

/// Conversion of an image's floats to the PNG's bytes.
struct Encoder {
  const Image& image;
  const Layout& layout;
  const PngSettings& settings;
  float gain;                      ///< factor of the exposure
  const SrgbQuantizer& quantizer;  ///< used for 8 bits

  /// Encodes a linear colour. `key` is the index of the sample; it seeds the dither.
  unsigned encode_color(float value, std::uint64_t key) const {
    if (settings.bits == 8 && !settings.dither) return quantizer(value);
    // The dither depends only on seed and sample, so that each run gives the same picture with any
    // number of threads.
    const float offset = settings.dither ? random_float(settings.seed, 0, key) : 0.5f;
    if (settings.bits == 8) return quantizer(value, offset);
    const float clamped = value > 0 ? std::min(value, 1.0f) : 0.0f;
    return static_cast<unsigned>(std::min(linear_to_srgb(clamped) * 65535.0f + offset, 65535.0f));
  }

  /// Encodes row `y`, with colours that are not multiplied by alpha. Opaque pixels of 8 bits, the
  /// common case, have a loop of their own.
  void encode_row(std::int64_t y, std::uint8_t* out) const {
    const std::size_t count = image.channel_count();
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width);
    if (settings.bits == 8 && layout.alpha < 0) {
      const auto [red, green, blue] = layout.color;
      std::vector<float> colors(3 * static_cast<std::size_t>(image.width));
      const float* pixel = &image.pixels[first * count];
      for (std::size_t i = 0; i < colors.size(); i += 3, pixel += count) {
        colors[i] = pixel[red] * gain;
        colors[i + 1] = pixel[green] * gain;
        colors[i + 2] = pixel[blue] * gain;
      }
      if (!settings.dither) {
        quantize_srgb(colors, out);
        return;
      }
      std::vector<float> offsets(colors.size());
      for (std::size_t i = 0; i < offsets.size(); ++i)
        offsets[i] = random_float(settings.seed, /*stream=*/0, 3 * first + i);
      quantize_srgb(colors, offsets, out);
      return;
    }
    const auto put = [&](unsigned code) {
      if (settings.bits == 16) *out++ = static_cast<std::uint8_t>(code >> 8);
      *out++ = static_cast<std::uint8_t>(code);
    };
    for (std::size_t i = first; i < first + static_cast<std::size_t>(image.width); ++i) {
      const float* pixel = &image.pixels[i * count];
      const float alpha = layout.alpha >= 0 ? clamp_coverage(pixel[layout.alpha]) : 1.0f;
      // PNG stores straight colours (PNG specification 1.2, section 2.4).
      const float scale = alpha > 0 ? gain / alpha : 0.0f;
      for (int c = 0; c < 3; ++c)
        put(encode_color(pixel[layout.color[c]] * scale, 3 * i + static_cast<std::size_t>(c)));
      if (layout.alpha >= 0)
        put(static_cast<unsigned>(alpha * (settings.bits == 16 ? 65535.0f : 255.0f) + 0.5f));
    }
  }
};

/// The output of libpng.
struct Writer {
  std::string bytes;
  std::string error;  ///< empty: no error
};

/// Appends data to the Writer that libpng's io pointer points to.
void append(png_structp png, png_bytep data, std::size_t size) {
  static_cast<Writer*>(png_get_io_ptr(png))->bytes.append(reinterpret_cast<char*>(data), size);
}

/// The pixels of an image as PNG stores them.
struct Codes {
  int width, height;
  int bits, samples;            ///< bits per sample; samples per pixel
  std::vector<png_bytep> rows;  ///< first byte of each row
  Texts texts;
  std::string packed;  ///< rows compressed by deflate_runs(); if empty, libpng compresses them
  std::size_t pixel_bytes() const { return static_cast<std::size_t>(samples * bits / 8); }
  std::size_t stride() const { return static_cast<std::size_t>(width) * pixel_bytes(); }
};

/// Filters a row: writes the filter's number, then each byte minus the average of its left and
/// upper neighbours (PNG specification 1.2, section 6.6). In the first row, where `above` is null,
/// writes each byte minus its left neighbour.
void filter_row(const std::uint8_t* __restrict row, const std::uint8_t* __restrict above,
                std::size_t pixel_bytes, std::span<std::uint8_t> filtered) {
  constexpr std::uint8_t kLeft = 1, kAverage = 3;
  filtered[0] = above ? kAverage : kLeft;
  std::uint8_t* __restrict out = &filtered[1];
  const std::size_t size = filtered.size() - 1;
  for (std::size_t i = 0; i < pixel_bytes; ++i)
    out[i] = static_cast<std::uint8_t>(row[i] - (above ? above[i] / 2 : 0));
  if (above) {
    for (std::size_t i = pixel_bytes; i < size; ++i)
      out[i] = static_cast<std::uint8_t>(row[i] - (row[i - pixel_bytes] + above[i]) / 2);
  } else {
    for (std::size_t i = pixel_bytes; i < size; ++i)
      out[i] = static_cast<std::uint8_t>(row[i] - row[i - pixel_bytes]);
  }
}

/// Filters all rows, then compresses them into `codes.packed`.
void pack_rows(Codes& codes) {
  const std::size_t row_size = codes.stride() + 1;
  std::vector<std::uint8_t> filtered(row_size * static_cast<std::size_t>(codes.height));
  parallel_for(
      codes.height,
      [&](std::int64_t y) {
        const auto i = static_cast<std::size_t>(y);
        filter_row(codes.rows[i], i > 0 ? codes.rows[i - 1] : nullptr, codes.pixel_bytes(),
                   std::span(filtered).subspan(i * row_size, row_size));
      },
      /*grain=*/64);
  codes.packed = deflate_runs(filtered);
}

/// Writes the compressed rows as IDAT chunks (of at most 2^30 bytes; the specification allows
/// 2^31 - 1), then the end of the file.
void write_packed(png_structp png, const std::string& packed) {
  constexpr std::size_t kMaxChunk = std::size_t{1} << 30;
  for (std::size_t i = 0; i < packed.size(); i += kMaxChunk)
    png_write_chunk(png, reinterpret_cast<png_const_bytep>("IDAT"),
                    reinterpret_cast<png_const_bytep>(&packed[i]),
                    std::min(kMaxChunk, packed.size() - i));
  png_write_chunk(png, reinterpret_cast<png_const_bytep>("IEND"), nullptr, 0);
}

/// Makes all calls of libpng. On an error libpng jumps back here by longjmp(), which skips
/// destructors, so no local here or in the callbacks owns memory.
void write_png(Writer& writer, const Effort& effort, Codes& codes) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &writer.error, store_png_error,
                                            ignore_png_warning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  if (!info) {
    png_destroy_write_struct(&png, nullptr);
    writer.error = "out of memory";
    return;
  }
  if (setjmp(png_jmpbuf(png)) == 0) {
    png_set_write_fn(png, &writer, append, nullptr);
    // The picture may be wider than libpng's default limit.
    png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_IHDR(png, info, static_cast<png_uint_32>(codes.width),
                 static_cast<png_uint_32>(codes.height), codes.bits,
                 codes.samples == 4 ? PNG_COLOR_TYPE_RGB_ALPHA : PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_compression_level(png, effort.level);
    png_set_compression_strategy(png, effort.strategy);
    png_set_compression_buffer_size(png, 1 << 18);  // bytes
    png_set_filter(png, PNG_FILTER_TYPE_BASE, effort.filters);
    for (auto& [keyword, value] : codes.texts) {
      png_text text = {};
      text.compression = PNG_TEXT_COMPRESSION_NONE;
      text.key = keyword.data();
      text.text = value.data();
      text.text_length = value.size();
      png_set_text(png, info, &text, /*num_text=*/1);  // copies keyword and value
    }
    png_write_info(png, info);
    if (!codes.packed.empty()) {
      write_packed(png, codes.packed);
    } else {
      png_write_image(png, codes.rows.data());
      png_write_end(png, info);
    }
  }
  png_destroy_write_struct(&png, &info);
}

Result<std::string> encode_rows(const Effort& effort, Codes& codes) {
  Writer writer;
  write_png(writer, effort, codes);
  if (!writer.error.empty())
    return make_error(ErrorCode::kOutput, "cannot encode the PNG: {}", writer.error);
  return std::move(writer.bytes);
}

}  // namespace

Result<std::string> encode_png(const Image& image, const PngSettings& settings) {
  PM_CHECK(settings.bits == 8 || settings.bits == 16);
  PM_TRY(const Layout layout, find_layout(image));
  const std::size_t stride = static_cast<std::size_t>(image.width) *
                             static_cast<std::size_t>(layout.samples()) *
                             static_cast<std::size_t>(settings.bits / 8);
  std::vector<std::uint8_t> bytes(stride * static_cast<std::size_t>(image.height));
  Codes codes{image.width,      image.height, settings.bits,
              layout.samples(), /*rows=*/{},  make_texts(image.attributes),
              /*packed=*/{}};
  for (std::size_t y = 0; y < static_cast<std::size_t>(image.height); ++y)
    codes.rows.push_back(&bytes[y * stride]);
  const Encoder encoder{image, layout, settings,
                        static_cast<float>(exact::exp2(static_cast<double>(settings.exposure))),
                        SrgbQuantizer::instance()};
  parallel_for(
      image.height,
      [&](std::int64_t y) { encoder.encode_row(y, codes.rows[static_cast<std::size_t>(y)]); },
      /*grain=*/16);
  // Compress the rows by deflate_runs(), where libpng's effort plays no role. For small files,
  // libpng also tries kSmallEfforts.
  pack_rows(codes);
  PM_TRY(std::string best, encode_rows(kSmallEfforts[0], codes));
  if (settings.effort == PngEffort::kFast) return best;
  codes.packed.clear();
  for (const Effort& effort : kSmallEfforts) {
    PM_TRY(std::string encoded, encode_rows(effort, codes));
    if (encoded.size() < best.size()) best = std::move(encoded);
  }
  return best;
}

}  // namespace polymorph
