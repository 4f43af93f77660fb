#include <gtest/gtest.h>

#include "compare/channel_rule.h"
#include "compare/compare.h"

namespace polymorph {
namespace {

TEST(ChannelRule, IdsAreNoColours) {
  for (const char* name : {"id", "id.object", "label", "crypto_object00.R", "crypto_label01.B",
                           "ViewLayer.CryptoMaterial00.r", "CryptoAsset02.blue"})
    EXPECT_EQ(channel_rule(name), ChannelRule::kId) << name;
  // Coverages, the preview of a Cryptomatte, and what only looks like one.
  for (const char* name : {"crypto_object00.G", "crypto_object00.A", "crypto_object.R", "light00.R",
                           "crypto00", "R.crypto", "labels", "P.X"})
    EXPECT_EQ(channel_rule(name), ChannelRule::kOther) << name;
  EXPECT_EQ(channel_rule("R"), ChannelRule::kColor);
  EXPECT_EQ(channel_rule("Z"), ChannelRule::kDepth);
  EXPECT_EQ(channel_rule("N.X"), ChannelRule::kNormal);
}

TEST(ChannelRule, OtherIdsFailHoweverNearTheirNumbersAre) {
  const auto compared = [](const char* channel, float actual, float reference) {
    Image a = make_image(4, 4, {channel}), b = a;
    for (float& v : a.pixels) v = actual;
    for (float& v : b.pixels) v = reference;
    return compare_images(a, b, {}).passed();
  };
  EXPECT_FALSE(compared("crypto_object00.R", 2.4e-18f, 2.4e-9f));
  EXPECT_FALSE(compared("label", 200, 201));
  EXPECT_TRUE(compared("label", 200, 200));
  EXPECT_TRUE(compared("crypto_object00.G", 0.500f, 0.501f)) << "a coverage has limits";
}

}  // namespace
}  // namespace polymorph
