#include <gtest/gtest.h>

#include "compare/compare.h"
#include "compare/display_mismatch.h"
#include "image/color_space.h"
#include "image/image_io.h"

namespace polymorph {
namespace {

Image with(const std::string& name, std::variant<std::string, int, float> value) {
  Image image = make_image(2, 2, {"R", "G", "B"});
  image.attributes = {{name, std::move(value)}};
  return image;
}

TEST(ShownMismatch, NamesWhatShowsEqualPixelsDifferently) {
  const Image plain = make_image(2, 2, {"R", "G", "B"});
  EXPECT_EQ(describe_display_mismatch(plain, with("polymorph/frame", 3)), "");
  EXPECT_EQ(describe_display_mismatch(with(kPixelAspectAttribute, 2.0f), plain),
            "pixel aspect ratio 2 instead of 1");
  EXPECT_EQ(describe_display_mismatch(plain, with(kOrientationAttribute, 6)),
            "orientation 1 instead of 6");
  EXPECT_EQ(describe_display_mismatch(with(kGammaAttribute, 1.0f), plain),
            "gamma 1 instead of none");
  EXPECT_EQ(describe_display_mismatch(with(kGammaAttribute, 1.0f), with(kGammaAttribute, 1.0f)),
            "");
  const Image profile = with(kColorProfileAttribute, std::string("9 bytes, 1"));
  EXPECT_EQ(describe_display_mismatch(profile, plain), "colour profile 9 bytes, 1 instead of none");
  EXPECT_EQ(describe_display_mismatch(profile, profile), "");
}

TEST(ShownMismatch, TellsColourSpacesApart) {
  const Image plain = make_image(2, 2, {"R", "G", "B"});
  const Image rec709 = with(kColorInteropAttribute, std::string("lin_rec709_scene"));
  const Image acescg = with(kColorInteropAttribute, std::string("lin_ap1_scene"));
  EXPECT_EQ(describe_display_mismatch(plain, rec709), "")
      << "files that say nothing are taken as Rec. 709";
  EXPECT_EQ(describe_display_mismatch(acescg, acescg), "");
  EXPECT_EQ(describe_display_mismatch(acescg, rec709),
            "colour space lin_ap1_scene instead of lin_rec709_scene");
  EXPECT_EQ(describe_display_mismatch(plain, acescg),
            "colour space lin_rec709_scene instead of lin_ap1_scene");
  EXPECT_EQ(compare_images(acescg, plain, {}).verdict, Verdict::kDiffers);
}

/// Numbers are compared as they are stored, and what is seen as it is seen.
TEST(ShownMismatch, FlipIsThatOfConvertedColours) {
  Image a = make_image(16, 16, {"R", "G", "B"}), b = a;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    a.pixels[i] = static_cast<float>(i % 7) / 7;
    b.pixels[i] = static_cast<float>(i % 5) / 5;
  }
  const Comparison expected = compare_images(a, b, {});
  for (Image* image : {&a, &b}) {
    convert_colors(*image, ColorSpace::kAcesCg);
    image->attributes = {{kColorInteropAttribute, std::string("lin_ap1_scene")}};
  }
  const Comparison result = compare_images(a, b, {});
  ASSERT_TRUE(result.flip && expected.flip);
  EXPECT_NEAR(result.flip->mean, expected.flip->mean, 1e-4);
  EXPECT_GT(result.flip->mean, 0.05);
  EXPECT_NE(result.channels[0].max, expected.channels[0].max);
}

TEST(ShownMismatch, FailsAComparisonOfEqualPixels) {
  const Image plain = make_image(2, 2, {"R", "G", "B"});
  const Comparison result = compare_images(with(kPixelAspectAttribute, 2.0f), plain, {});
  EXPECT_EQ(result.verdict, Verdict::kDiffers);
  EXPECT_NE(result.reason.find("shown differently: pixel aspect ratio 2"), std::string::npos)
      << result.reason;
}

}  // namespace
}  // namespace polymorph
