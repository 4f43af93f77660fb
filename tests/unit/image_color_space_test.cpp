#include "image/color_space.h"

#include <bit>
#include <cmath>

#include "image/image_io.h"
#include "testing/image.h"

namespace polymorph {
namespace {

Image one_pixel(std::vector<std::string> channels, std::vector<float> values) {
  Image image = make_image(1, 1, std::move(channels));
  image.pixels = std::move(values);
  return image;
}

/// Matrix from linear RGB to XYZ by its definition (SMPTE RP 177), in double.
struct ToXyz {
  double m[3][3];
};
ToXyz matrix_to_xyz(const float (&xy)[8]) {
  double p[3][3], white[3];
  const auto column = [&](int i, double out[3]) {
    const auto x = static_cast<double>(xy[2 * i]), y = static_cast<double>(xy[2 * i + 1]);
    out[0] = x / y, out[1] = 1, out[2] = (1 - x - y) / y;
  };
  for (int i = 0; i < 3; ++i) {
    double xyz[3];
    column(i, xyz);
    for (int k = 0; k < 3; ++k) p[k][i] = xyz[k];
  }
  column(3, white);
  const auto det = [](const double(&a)[3][3]) {
    return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
           a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
           a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
  };
  ToXyz out{};
  for (int i = 0; i < 3; ++i) {  // Cramer: how much of each primary makes white
    double replaced[3][3];
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) replaced[r][c] = c == i ? white[r] : p[r][c];
    for (int r = 0; r < 3; ++r) out.m[r][i] = p[r][i] * det(replaced) / det(p);
  }
  return out;
}

/// Cone responses of Bradford's transform for a colour.
void bradford(const ToXyz& to_xyz, const float* rgb, double (&cone)[3]) {
  constexpr double kBradford[3][3] = {
      {0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}};
  double xyz[3]{};
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) xyz[r] += to_xyz.m[r][c] * static_cast<double>(rgb[c]);
  for (int r = 0; r < 3; ++r) {
    cone[r] = 0;
    for (int c = 0; c < 3; ++c) cone[r] += kBradford[r][c] * xyz[c];
  }
}

/// Two colours are the same where their cone responses are, each over that of its own white.
TEST(ColorSpace, ConvertedColoursLookTheSameToAdaptedEyes) {
  const ToXyz rec709 = matrix_to_xyz(color_space_label(ColorSpace::kRec709).chromaticities);
  const ToXyz acescg = matrix_to_xyz(color_space_label(ColorSpace::kAcesCg).chromaticities);
  const float white[3] = {1, 1, 1};
  double white709[3], white_ap1[3];
  bradford(rec709, white, white709);
  bradford(acescg, white, white_ap1);
  const Image before = random_image(16, 16, {"R", "G", "B"});
  Image after = before;
  convert_colors(after, ColorSpace::kAcesCg);
  for (std::size_t i = 0; i < before.pixels.size(); i += 3) {
    double a[3], b[3];
    bradford(rec709, &before.pixels[i], a);
    bradford(acescg, &after.pixels[i], b);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c] / white709[c], b[c] / white_ap1[c], 2e-6);
  }
}

TEST(ColorSpace, GreysKeepTheirNumbers) {
  Image image = one_pixel({"R", "G", "B"}, {1, 1, 1});
  convert_colors(image, ColorSpace::kAcesCg);
  EXPECT_EQ(image.pixels, (std::vector<float>{1, 1, 1}));
  image = one_pixel({"R", "G", "B"}, {0.18f, 0.18f, 0.18f});
  convert_colors(image, ColorSpace::kAcesCg);
  for (const float v : image.pixels) EXPECT_NEAR(v, 0.18f, 1e-7f);
}

/// The bits that every machine must give.
TEST(ColorSpace, GivesTheSameBitsEverywhere) {
  Image image = one_pixel({"R", "G", "B"}, {0.1f, 0.7f, 1.3f});
  convert_colors(image, ColorSpace::kAcesCg);
  const auto bits = [&](std::size_t i) { return std::bit_cast<std::uint32_t>(image.pixels[i]); };
  EXPECT_EQ(bits(0), 0x3eb89c88u);
  EXPECT_EQ(bits(1), 0x3f2a7c0bu);
  EXPECT_EQ(bits(2), 0x3f9ad188u);
}

TEST(ColorSpace, ConvertsLayersOfColoursAlone) {
  const std::vector<std::string> channels{"R",
                                          "G",
                                          "B",
                                          "A",
                                          "Z",
                                          "N.X",
                                          "N.Y",
                                          "N.Z",
                                          "albedo.B",
                                          "albedo.G",
                                          "albedo.R",
                                          "crypto_object00.A",
                                          "crypto_object00.B",
                                          "crypto_object00.G",
                                          "crypto_object00.R",
                                          "half.R",
                                          "id"};
  const Image before = random_image(3, 3, channels);
  Image after = before;
  convert_colors(after, ColorSpace::kAcesCg);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const bool is_color = channels[c].size() == 1 ? channels[c] != "A" && channels[c] != "Z"
                                                  : channels[c].starts_with("albedo.");
    EXPECT_EQ(after.at(1, 1, static_cast<int>(c)) != before.at(1, 1, static_cast<int>(c)), is_color)
        << channels[c];
  }
  // The layer's channels are taken by name, in whatever order they are.
  Image plain =
      one_pixel({"R", "G", "B"}, {before.at(1, 1, 10), before.at(1, 1, 9), before.at(1, 1, 8)});
  convert_colors(plain, ColorSpace::kAcesCg);
  for (int c = 0; c < 3; ++c)
    EXPECT_EQ(plain.pixels[static_cast<std::size_t>(c)], after.at(1, 1, 10 - c));
}

TEST(ColorSpace, FilesSayTheirSpaceAndComeBackInRec709) {
  const Image image = random_image(9, 5, {"R", "G", "B", "A", "Z"});
  const auto bytes = encode_exr(image, {.color_space = ColorSpace::kAcesCg});
  ASSERT_TRUE(bytes) << bytes.error().message;
  const Image stored = read_back("a.exr", *bytes, {.stored_colors = true});
  EXPECT_EQ(color_space_name(stored), "lin_ap1_scene");
  Image expected = image;
  convert_colors(expected, ColorSpace::kAcesCg);
  const Image back = read_back("a.exr", *bytes, {.stored_colors = false});
  EXPECT_EQ(color_space_name(back), "lin_rec709_scene");
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    EXPECT_NEAR(stored.pixels[i], expected.pixels[i], 1e-3f * std::abs(expected.pixels[i]));
    EXPECT_NEAR(back.pixels[i], image.pixels[i], 3e-3f);  // it went through half floats
  }
  for (std::size_t i = 3; i < image.pixels.size(); i += 5) {  // alpha and depth
    EXPECT_EQ(back.pixels[i], stored.pixels[i]);
    EXPECT_EQ(back.pixels[i + 1], image.pixels[i + 1]);
  }
  EXPECT_TRUE(encode_exr(stored)) << "what was read can be written again";
}

TEST(ColorSpace, PrimariesAloneSayAcesCgToo) {
  Image image = random_image(2, 2, {"R", "G", "B"});
  EXPECT_EQ(color_space_name(image), "lin_rec709_scene");
  const std::string ap1 = "0.713 0.293 0.165 0.83 0.128 0.044 0.3217 0.3377";
  image.attributes = {{kColorPrimariesAttribute, ap1}};
  EXPECT_EQ(color_space_name(image), "lin_ap1_scene");
  image.attributes.push_back({kColorInteropAttribute, std::string("lin_rec2020_scene")});
  EXPECT_EQ(color_space_name(image), "lin_rec2020_scene");
  const std::vector<float> before = image.pixels;
  convert_to_rec709(image);
  EXPECT_EQ(image.pixels, before) << "spaces that are not known stay";
  image.attributes = {{kColorPrimariesAttribute, std::string("0.6 0.3 0.3 0.6 0.15 0.06 0.3 0.3")}};
  EXPECT_EQ(color_space_name(image), "0.6 0.3 0.3 0.6 0.15 0.06 0.3 0.3");
}

}  // namespace
}  // namespace polymorph
