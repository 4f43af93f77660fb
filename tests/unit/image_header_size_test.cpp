#include "image/header_size.h"

#include <gtest/gtest.h>

#include <string>

#include "image/image_io.h"
#include "testing/image.h"

namespace polymorph {
namespace {

using namespace std::string_literals;

void expect_size(const std::string& bytes, const char* format, double width, double height,
                 double channels) {
  const auto size = header_size(bytes, format);
  ASSERT_TRUE(size) << format;
  EXPECT_EQ(size->width, width) << format;
  EXPECT_EQ(size->height, height) << format;
  EXPECT_EQ(size->channels, channels) << format;
}

TEST(HeaderSize, IsThatOfTheImage) {
  expect_size(make_png(3, 2, 8, 2, {std::string(9, 0)}), "png", 3, 2, 3);
  const auto exr = encode_exr(make_image(5, 4, {"R", "G", "B", "A", "Z"}));
  ASSERT_TRUE(exr);
  expect_size(*exr, "openexr", 5, 4, 5);
  const auto parts = encode_exr(make_image(5, 4, {"R", "Z", "N.X", "N.Y"}), {.multipart = true});
  ASSERT_TRUE(parts);
  expect_size(*parts, "openexr", 5, 4, 4);
  expect_size("GIF89a\3\0\2\1\0\0\0"s, "gif", 3, 258, 4);
  expect_size("\xff\xd8\xff\xe0\0\4ab\xff\xc2\0\x11\x08\1\0\2\0\3"s, "jpeg", 512, 256, 3);
  expect_size("RIFF\0\0\0\0WEBPVP8X\n\0\0\0\0\0\0\0\2\0\0\1\0\0"s, "webp", 3, 2, 4);
  expect_size("\xff\x4f\xff\x51\0\0\0\0\0\0\0\7\0\0\0\6"s, "jpeg2000", 7, 6, 4);
}

TEST(HeaderSize, IsThatOfTilesWhereTheyAreLarger) {
  // Little-endian; a directory of four entries: tag, type (LONG), count, value.
  std::string tiff = "II*\0\x08\0\0\0\4\0"s;
  for (const auto& [tag, value] : {std::pair(256, 16), {257, 200}, {322, 100}, {323, 50}})
    tiff += std::string{static_cast<char>(tag),
                        static_cast<char>(tag >> 8),
                        4,
                        0,
                        1,
                        0,
                        0,
                        0,
                        static_cast<char>(value),
                        0,
                        0,
                        0};
  expect_size(tiff, "tiff", 100, 200, 1);
}

TEST(HeaderSize, IsUnknownWhereTheHeaderIsCutShort) {
  EXPECT_FALSE(header_size("\xff\xd8\xff", "jpeg"));
  EXPECT_FALSE(header_size("\x76\x2f\x31\x01\2\0\0\0abc", "openexr"));
  EXPECT_FALSE(header_size("RIFF", "webp"));
  EXPECT_FALSE(header_size("P6\n9 9\n255\n", "pnm"));
}

}  // namespace
}  // namespace polymorph
