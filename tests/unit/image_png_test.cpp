#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "base/parallel.h"
#include "image/image_io.h"
#include "testing/image.h"

namespace polymorph {
namespace {

const ReadImageSettings kCodes{TransferCurve::kLinear, AlphaMode::kStraight, 1 << 20};

Image grey_ramp(int width) {
  Image image = make_image(width, 1, {"R", "G", "B"});
  for (int x = 0; x < width; ++x)
    for (int c = 0; c < 3; ++c)
      image.at(x, 0, c) = static_cast<float>(x) / static_cast<float>(width - 1);
  return image;
}

TEST(SrgbCurve, HasTheStandardsValues) {
  // IEC 61966-2-1: the branches meet at 0.0031308 / 0.04045; half of the light is code 0.7354.
  EXPECT_NEAR(linear_to_srgb(0.5f), 0.735357f, 1e-6f);
  EXPECT_NEAR(linear_to_srgb(0.18f), 0.461356f, 1e-6f);
  EXPECT_NEAR(linear_to_srgb(0.001f), 0.01292f, 1e-7f);
  EXPECT_NEAR(srgb_to_linear(0.5f), 0.214041f, 1e-6f);
  EXPECT_EQ(srgb_to_linear(0.0f), 0.0f);
  EXPECT_EQ(srgb_to_linear(1.0f), 1.0f);
  EXPECT_NEAR(linear_to_srgb(1.0f), 1.0f, 1e-7f);
  for (int i = 0; i <= 1000; ++i) {
    const float v = static_cast<float>(i) / 1000;
    EXPECT_NEAR(srgb_to_linear(linear_to_srgb(v)), v, 2e-6f);
  }
}

TEST(SrgbQuantizer, RoundsAsTheCurveDoes) {
  const SrgbQuantizer& quantize = SrgbQuantizer::instance();
  for (int i = -1000; i <= 200000; ++i) {
    const float v = static_cast<float>(i) / 190000.0f;
    const double exact = v <= 0 ? 0 : v >= 1 ? 255 : 255.0 * static_cast<double>(linear_to_srgb(v));
    ASSERT_NEAR(quantize(v), exact, 0.5 + 2e-4) << v;
  }
  for (int code = 0; code < 256; ++code)
    EXPECT_EQ(quantize(srgb_to_linear(static_cast<float>(code) / 255.0f)), code);
  EXPECT_EQ(quantize(NAN), 0);
  EXPECT_EQ(quantize(INFINITY), 255);
  EXPECT_EQ(quantize(-INFINITY), 0);
}

TEST(EncodePng, TakesAnAlphaThatIsNoNumberForNothing) {
  Image image = make_image(3, 1, {"R", "G", "B", "A"});
  const float alphas[] = {NAN, INFINITY, -INFINITY};
  for (int x = 0; x < 3; ++x) image.at(x, 0, 3) = alphas[x];
  for (const int bits : {8, 16}) {
    const auto png = encode_png(image, {.bits = bits});
    ASSERT_TRUE(png);
    const Image read = read_back("a.png", *png, kCodes);
    EXPECT_EQ(read.at(0, 0, 3), 0.0f);
    EXPECT_EQ(read.at(1, 0, 3), 1.0f);
    EXPECT_EQ(read.at(2, 0, 3), 0.0f);
  }
}

TEST(EncodePng, WritesTheCurveAtKnownPoints) {
  Image image = make_image(5, 1, {"R", "G", "B"});
  image.pixels = {0,         0.5f, 1, 0.18f, 0.0031308f, 2,     -1,  NAN,
                  0.214041f, 1,    1, 1,     0.25f,      0.75f, 0.1f};
  const Image back = read_back("a.png", *encode_png(image), kCodes);
  const std::vector<int> expected{0,   188, 255, 118, 10,  255, 0, 0,
                                  127, 255, 255, 255, 137, 225, 89};
  ASSERT_EQ(back.pixels.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_EQ(std::lround(back.pixels[i] * 255), expected[i]) << i;
}

TEST(EncodePng, SixteenBitsKeepSixteenBits) {
  const Image image = grey_ramp(1025);
  const Image back = read_back("a.png", *encode_png(image, {.bits = 16}));
  std::set<float> values;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    EXPECT_NEAR(back.pixels[i], image.pixels[i], 2e-5f);
    values.insert(back.pixels[i]);
  }
  EXPECT_EQ(values.size(), 1025u);
}

TEST(EncodePng, EveryCodeSurvivesReadingAndWriting) {
  Image image = make_image(256, 1, {"R", "G", "B"});
  for (int x = 0; x < 256; ++x)
    for (int c = 0; c < 3; ++c) image.at(x, 0, c) = srgb_to_linear(static_cast<float>(x) / 255.0f);
  const std::string once = *encode_png(image);
  EXPECT_TRUE(*encode_png(read_back("a.png", once)) == once);
}

TEST(EncodePng, ExposureIsInStops) {
  Image image = make_image(1, 1, {"R", "G", "B"});
  image.pixels = {0.125f, 0.25f, 0.0625f};
  const Image back = read_back("a.png", *encode_png(image, {.exposure = 2}), kCodes);
  EXPECT_EQ(std::lround(back.pixels[0] * 255), 188);  // 0.5
  EXPECT_EQ(back.pixels[1], 1.0f);
}

TEST(EncodePng, WritesAlphaOnlyWhereItIsNeeded) {
  Image image = make_image(2, 1, {"R", "G", "B", "A", "Z"});
  image.pixels = {0.25f, 0.5f, 0, 1, 7, 0.25f, 0.5f, 0, 1, 7};
  EXPECT_EQ(read_back("a.png", *encode_png(image)).channels,
            (std::vector<std::string>{"R", "G", "B"}));
  image.at(1, 0, 3) = 0.5f;  // premultiplied: straight colours are 0.5, 1, 0
  const std::string bytes = *encode_png(image);
  const Image codes = read_back("a.png", bytes, kCodes);
  EXPECT_EQ(codes.channels, (std::vector<std::string>{"R", "G", "B", "A"}));
  EXPECT_EQ(std::lround(codes.at(1, 0, 0) * 255), 188);
  EXPECT_EQ(std::lround(codes.at(1, 0, 1) * 255), 255);
  EXPECT_EQ(std::lround(codes.at(1, 0, 3) * 255), 128);
  const Image back = read_back("a.png", bytes);
  EXPECT_NEAR(back.at(1, 0, 0), 0.25f, 0.005f);
  EXPECT_NEAR(back.at(1, 0, 1), 0.5f, 0.005f);
  const Image straight = read_back("a.png", bytes, {.alpha = AlphaMode::kStraight});
  EXPECT_NEAR(straight.at(1, 0, 0), 0.5f, 0.005f);
  EXPECT_NEAR(straight.at(1, 0, 1), 1.0f, 1e-6f);
}

TEST(EncodePng, DitherIsRepeatableAndKeepsTheMean) {
  Image image = make_image(64, 64, {"R", "G", "B"});
  const float between = srgb_to_linear(100.25f / 255.0f);
  for (float& value : image.pixels) value = between;
  const PngSettings settings{.dither = true, .seed = 5};
  const std::string bytes = *encode_png(image, settings);
  set_thread_count(1);
  EXPECT_TRUE(*encode_png(image, settings) == bytes);
  set_thread_count(0);
  EXPECT_FALSE(*encode_png(image, {.dither = true, .seed = 6}) == bytes);
  double sum = 0;
  for (const float value : read_back("a.png", bytes, kCodes).pixels) {
    const auto code = std::lround(value * 255);
    ASSERT_TRUE(code == 100 || code == 101);
    sum += static_cast<double>(code);
  }
  EXPECT_NEAR(sum / (64 * 64 * 3), 100.25, 0.02);
}

TEST(EncodePng, TagsItsColourSpace) {
  const std::string bytes = *encode_png(grey_ramp(16));
  for (const char* chunk : {"sRGB", "gAMA", "cHRM"})
    EXPECT_NE(bytes.find(chunk), std::string::npos) << chunk;
  EXPECT_EQ(bytes.find("tIME"), std::string::npos);
}

TEST(EncodePng, SmallEffortIsNeverLargerAndShowsTheSame) {
  Image flat = make_image(300, 200, {"R", "G", "B"});
  for (std::size_t i = 0; i < flat.pixels.size(); ++i)
    flat.pixels[i] = (i / 90) % 7 == 0 ? 0.5f : 0.1f;
  for (const Image& image : {flat, random_image(300, 200, {"R", "G", "B"})}) {
    const std::string fast = *encode_png(image),
                      small = *encode_png(image, {.effort = PngEffort::kSmall});
    EXPECT_LE(small.size(), fast.size());
    EXPECT_EQ(pixel_digest(read_back("a.png", small)), pixel_digest(read_back("a.png", fast)));
  }
  EXPECT_LT(encode_png(flat, {.effort = PngEffort::kSmall})->size(), encode_png(flat)->size());
}

TEST(EncodePng, NeedsColours) {
  const auto bytes = encode_png(random_image(2, 2, {"Z"}));
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().code, ErrorCode::kInput);
}

}  // namespace
}  // namespace polymorph
