#include <gtest/gtest.h>

#include "compare/channel_rule.h"
#include "compare/compare.h"
#include "image/image_io.h"

namespace polymorph {
namespace {

TEST(ChannelRule, IdsAreNoColours) {
  for (const char* name : {"id", "id.object", "label", "crypto_object00.R", "crypto_label01.B",
                           "ViewLayer.CryptoMaterial00.r", "CryptoAsset02.blue", "ID", "objectId",
                           "Id.X", "OBJECTID.R", "mat_id", "primIDs", "IDMask.R", "instance-id.0",
                           "labels", "ViewLayer.IndexOB.X"})
    EXPECT_EQ(channel_rule(name), ChannelRule::kId) << name;
  // Coverages, the preview of a Cryptomatte, and what only looks like one.
  for (const char* name :
       {"crypto_object00.G", "crypto_object00.A", "crypto_object.R", "light00.R", "crypto00",
        "R.crypto", "crypto.id", "cryptomatte_id00.G", "ViewLayer.CryptoId00.a", "P.X", "grid",
        "width", "Rigid.X", "video", "idle", "Index.X"})
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
  EXPECT_FALSE(compared("Id.X", 1000, 1001));
  EXPECT_TRUE(compared("crypto_object00.G", 0.500f, 0.501f)) << "a coverage has limits";
}

TEST(ChannelRule, WholeNumbersAreIdsAndTheLineSaysSo) {
  Image a = make_image(4, 4, {"R", "part"}), b = a;
  for (float& v : a.pixels) v = 1000;
  b = a;
  b.at(1, 2, 1) = 1001;
  b.at(3, 2, 1) = 7;
  EXPECT_FALSE(compare_images(a, b, {}).passed()) << "7 is far from 1000";
  b.at(3, 2, 1) = 1000;
  EXPECT_TRUE(compare_images(a, b, {}).passed());
  b.attributes = {{kIdChannelsAttribute, std::string("R2,part")}};  // in one of both is enough
  const Comparison result = compare_images(a, b, {});
  EXPECT_FALSE(result.passed());
  EXPECT_TRUE(result.reason.ends_with("; another id in part at 1 pixel, the first at (1, 2)"))
      << result.reason;
}

}  // namespace
}  // namespace polymorph
