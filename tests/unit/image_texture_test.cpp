#include "image/texture.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <set>

#include "image/image_io.h"
#include "testing/image.h"
#include "testing/texture.h"

namespace polymorph {
namespace {

/// Returns a PNG of random samples; `color` as for make_png().
std::string random_png(int width, int height, int bits, int color, std::size_t channels) {
  std::vector<std::string> rows;
  for (int y = 0; y < height; ++y) {
    std::string row(static_cast<std::size_t>(width * bits / 8) * channels, 0);
    for (std::size_t i = 0; i < row.size(); ++i)
      row[i] = static_cast<char>(random_below(256, static_cast<std::uint64_t>(y), channels, i));
    rows.push_back(row);
  }
  return make_png(width, height, bits, color, rows);
}

bool have_same_bits(Vec3 a, Vec3 b) {
  const auto bits = [](float v) { return std::bit_cast<std::uint32_t>(v); };
  return bits(a.x) == bits(b.x) && bits(a.y) == bits(b.y) && bits(a.z) == bits(b.z);
}

/// Expects a texture to be the image of the same file, which read_image() gives as floats.
void expect_same_texture(const Texture& texture, const Image& image) {
  EXPECT_EQ(texture_image(texture).channels, image.channels);
  EXPECT_EQ(texture_image(texture).pixels, image.pixels);
  const auto floats = float_texture(image);
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  for (const Vec2 uv : {Vec2{0, 0}, Vec2{1, 1}, Vec2{-3.25f, 7.5f}, Vec2{kInfinite, NAN}})
    EXPECT_TRUE(have_same_bits(sample_texture(texture, uv), sample_texture(*floats, uv)));
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const auto coordinate = [&](std::uint64_t axis) {
      return static_cast<float>(random_below(1 << 20, i, axis, 0)) / (1 << 19) - 0.5f;
    };
    const Vec2 uv{coordinate(0), coordinate(1)};
    ASSERT_TRUE(have_same_bits(sample_texture(texture, uv), sample_texture(*floats, uv)))
        << uv.x << " " << uv.y;
  }
}

constexpr ReadImageSettings kStraight{.alpha = AlphaMode::kStraight};

TEST(Texture, CodesGiveTheBitsOfFloats) {
  const struct {
    int color;
    std::size_t channels;
  } kinds[] = {{0, 1}, {4, 2}, {2, 3}, {6, 4}};
  for (const auto& kind : kinds) {
    const std::string png = random_png(37, 11, 8, kind.color, kind.channels);
    const auto texture = decode_texture(png, "t.png");
    ASSERT_TRUE(texture) << texture.error().message;
    ASSERT_TRUE(texture->codes) << kind.channels;
    EXPECT_EQ(pixel_bytes(*texture), 37 * 11 * kind.channels);
    EXPECT_TRUE(texture->image.pixels.empty());
    const auto image = decode_image(png, "t.png", kStraight);
    ASSERT_TRUE(image) << image.error().message;
    ASSERT_EQ(image->channel_count(), kind.channels % 2 == 0 ? 4u : 3u);
    expect_same_texture(*texture, *image);
  }
}

TEST(Texture, FilesOfOtherFormatsStayCodesWithoutAlpha) {
  for (const char* name : {"rgb.jpg", "cmyk.jpg", "rgb8.tif"}) {
    const auto texture = read_texture(data_file(name));
    ASSERT_TRUE(texture) << texture.error().message;
    const auto image = read_image(data_file(name), kStraight);
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_TRUE(texture->codes) << name;
    expect_same_texture(*texture, *image);
  }
}

TEST(Texture, EveryCodeHasItsLinearValue) {
  std::string row;
  for (int code = 0; code < 256; ++code) row += static_cast<char>(code);
  const auto texture = decode_texture(make_png(256, 1, 8, 0, {row}), "t.png");
  ASSERT_TRUE(texture && texture->codes);
  for (std::size_t code = 0; code < 256; ++code)
    EXPECT_EQ(texture->view().texel(code, 0).y, srgb_decode_table8()[code]);
}

TEST(Texture, SixteenBitsAndFloatsStayFloats) {
  const std::string png = random_png(13, 7, 16, 2, 3);
  const auto texture = decode_texture(png, "t.png");
  ASSERT_TRUE(texture) << texture.error().message;
  EXPECT_FALSE(texture->codes);
  EXPECT_EQ(pixel_bytes(*texture), 13 * 7 * 3 * sizeof(float));
  expect_same_texture(*texture, *decode_image(png, "t.png", kStraight));
  const Image image = random_image(5, 3, {"R", "G", "B"});
  const auto exr = decode_texture(*encode_exr(image), "t.exr");
  ASSERT_TRUE(exr) << exr.error().message;
  EXPECT_FALSE(exr->codes);
  expect_same_texture(*exr, image);
}

TEST(Texture, CodesInAcesCgAreConvertedToRec709) {
  Image image = random_image(5, 3, {"R", "G", "B"});
  image.attributes = {
      {kColorInteropAttribute, std::string(color_space_label(ColorSpace::kAcesCg).interop_id)}};
  const std::string png = *encode_png(image);
  const auto stored = decode_image(png, "t.png", {.stored_colors = true});
  const auto texture = decode_texture(png, "t.png");
  ASSERT_TRUE(stored && texture);
  EXPECT_NE(texture_image(*texture).pixels, stored->pixels);
  expect_same_texture(*texture, *decode_image(png, "t.png", kStraight));
}

TEST(Texture, TheDigestDependsOnSizeAndOnEveryCode) {
  const auto digest = [](int width, int height, int color, const std::string& samples) {
    std::vector<std::string> rows;
    const std::size_t size = samples.size() / static_cast<std::size_t>(height);
    for (std::size_t at = 0; at < samples.size(); at += size)
      rows.push_back(samples.substr(at, size));
    const auto texture = decode_texture(make_png(width, height, 8, color, rows), "t.png");
    EXPECT_TRUE(texture && texture->codes);
    return pixel_digest(*texture);
  };
  const std::string samples = "abcdefghijkl";
  std::set<std::string> digests{digest(12, 1, 0, samples), digest(6, 2, 0, samples),
                                digest(4, 1, 2, samples), digest(6, 1, 4, samples),
                                digest(3, 1, 6, samples)};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    std::string other = samples;
    other[i] = 'z';
    digests.insert(digest(12, 1, 0, other));
  }
  EXPECT_EQ(digests.size(), 5 + samples.size());
  EXPECT_EQ(digest(12, 1, 0, samples), digest(12, 1, 0, samples));
  const Image floats = random_image(3, 2, {"R", "G", "B"});
  EXPECT_EQ(pixel_digest(*float_texture(floats)), pixel_digest(floats));
}

TEST(Texture, AnEmptyTextureIsWhite) {
  EXPECT_TRUE(have_same_bits(sample_texture(Texture{}, {0.5f, 0.5f}), {1, 1, 1}));
}

}  // namespace
}  // namespace polymorph
