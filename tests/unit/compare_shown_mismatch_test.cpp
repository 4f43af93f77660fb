#include <gtest/gtest.h>

#include "compare/compare.h"
#include "compare/shown_mismatch.h"
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
  EXPECT_EQ(shown_mismatch(plain, with("polymorph/frame", 3)), "");
  EXPECT_EQ(shown_mismatch(with(kPixelAspectAttribute, 2.0f), plain),
            "pixel aspect ratio 2 instead of 1");
  EXPECT_EQ(shown_mismatch(plain, with(kOrientationAttribute, 6)), "orientation 1 instead of 6");
  EXPECT_EQ(shown_mismatch(with(kGammaAttribute, 1.0f), plain), "gamma 1 instead of none");
  EXPECT_EQ(shown_mismatch(with(kGammaAttribute, 1.0f), with(kGammaAttribute, 1.0f)), "");
  const Image profile = with(kColorProfileAttribute, std::string("9 bytes, 1"));
  EXPECT_EQ(shown_mismatch(profile, plain), "colour profile 9 bytes, 1 instead of none");
  EXPECT_EQ(shown_mismatch(profile, profile), "");
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
