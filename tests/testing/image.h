// Helpers of the tests of image/: random images, and PNG files made byte by byte.
#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <filesystem>
#include <string>
#include <vector>

#include "base/random.h"
#include "image/image.h"
#include "image/image_io.h"
#include "testing/paths.h"
#include "testing/temporary_folder.h"

namespace polymorph {

inline std::filesystem::path data_file(const std::string& name) {
  return source_dir() / "tests/data/image" / name;
}

/// Returns an image of random multiples of 1/1024 in [0, 1), which half floats hold exactly.
inline Image random_image(int width, int height, const std::vector<std::string>& channels,
                          std::uint64_t seed = 1) {
  Image image = make_image(width, height, channels);
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = static_cast<float>(random_below(1024, seed, 0, i)) / 1024.0f;
  return image;
}

/// Writes `bytes` to a file of this name and reads the picture in it. After an error, fails the
/// test and returns an empty image.
inline Image read_back(const std::string& name, const std::string& bytes,
                       const ReadImageSettings& settings = {}) {
  const TemporaryFolder folder;
  auto image = read_image(folder.write(name, bytes), settings);
  EXPECT_TRUE(image) << image.error().message;
  return image ? *std::move(image) : Image{};
}

inline std::string read_big_endian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 255u);
  return bytes;
}

inline std::string png_chunk(const std::string& type, const std::string& data) {
  const std::string body = type + data;
  const auto sum =
      crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  return read_big_endian(static_cast<std::uint32_t>(data.size())) + body +
         read_big_endian(static_cast<std::uint32_t>(sum));
}

/// Returns a PNG made of raw rows (without their filter bytes). `bits`: per channel; `color`: 0
/// grey, 2 RGB, 3 palette, 4 grey + alpha, 6 RGBA.
inline std::string make_png(int width, int height, int bits, int color,
                            const std::vector<std::string>& rows, const std::string& palette = "") {
  std::string raw;
  for (const std::string& row : rows) raw += '\0' + row;
  std::string packed(compressBound(raw.size()), '\0');
  uLongf size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(raw.data()), raw.size());
  packed.resize(size);
  std::string header = read_big_endian(static_cast<std::uint32_t>(width)) +
                       read_big_endian(static_cast<std::uint32_t>(height));
  header += {static_cast<char>(bits), static_cast<char>(color), 0, 0, 0};
  return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", header) +
         (palette.empty() ? "" : png_chunk("PLTE", palette)) + png_chunk("IDAT", packed) +
         png_chunk("IEND", "");
}

}  // namespace polymorph
