#include "image/extract_matte.h"

#include <bit>
#include <vector>

#include "testing/image.h"

namespace polymorph {
namespace {

float id_float(std::uint32_t bits) { return std::bit_cast<float>(bits); }
constexpr std::uint32_t kElk = 0x3f123456, kSpot = 0xbe00ff01, kFloor = 0x40abcdef;

/// Two pixels of two groups: the elk covers 0.75 of the first, with spot and floor behind it, and
/// 0.125 of the second, where it is in the third rank.
Image two_pixels(const std::string& layer, const std::vector<std::string>& suffixes) {
  std::vector<std::string> channels;
  for (const char* group : {"00", "01"})
    for (const std::string& suffix : suffixes) channels.push_back(layer + group + "." + suffix);
  Image image = make_image(2, 1, channels);
  image.pixels = {
      id_float(kElk),   0.75f,  id_float(kSpot), 0.1875f, id_float(kFloor), 0.0625f, 0, 0,
      id_float(kFloor), 0.625f, id_float(kSpot), 0.25f,   id_float(kElk),   0.125f,  0, 0};
  image.attributes = {
      {"cryptomatte/1234567/name", layer},
      {"cryptomatte/1234567/manifest",
       std::string(R"({"elk": "3f123456", "spot": "be00ff01", "floor": "40abcdef"})")}};
  return image;
}

std::vector<float> grey(float first, float second) {
  return {first, first, first, second, second, second};
}

TEST(ExtractMatte, SumsTheCoverageOfAName) {
  const Image image = two_pixels("crypto_object", {"R", "G", "B", "A"});
  const auto coverage = [&](const std::string& name) {
    const auto matte = extract_matte(image, name, "f.exr");
    EXPECT_TRUE(matte) << matte.error().message;
    EXPECT_EQ(matte->channels, (std::vector<std::string>{"R", "G", "B"}));
    return matte->pixels;
  };
  EXPECT_EQ(coverage("elk"), grey(0.75f, 0.125f));
  EXPECT_EQ(coverage("spot"), grey(0.1875f, 0.25f));
  EXPECT_EQ(coverage("crypto_object.floor"), grey(0.0625f, 0.625f));
}

TEST(ExtractMatte, ReadsOtherProgramsSpellings) {
  for (const std::vector<std::string>& suffixes :
       {std::vector<std::string>{"r", "g", "b", "a"}, {"red", "green", "blue", "alpha"}}) {
    const auto matte =
        extract_matte(two_pixels("ViewLayer.CryptoObject", suffixes), "elk", "f.exr");
    ASSERT_TRUE(matte) << matte.error().message;
    EXPECT_EQ(matte->pixels, grey(0.75f, 0.125f));
  }
}

TEST(ExtractMatte, ListsTheNamesWhereOneIsUnknown) {
  const auto matte =
      extract_matte(two_pixels("crypto_object", {"R", "G", "B", "A"}), "spott", "f.exr");
  ASSERT_FALSE(matte);
  EXPECT_EQ(matte.error().code, ErrorCode::kUsage);
  for (const char* words :
       {"f.exr: no matte is called \"spott\"", "did you mean \"spot\"", "\"elk\"", "\"floor\""})
    EXPECT_NE(matte.error().message.find(words), std::string::npos) << matte.error().message;
}

TEST(ExtractMatte, AsksForTheLayerWhereOneNameMeansTwoThings) {
  Image image = two_pixels("crypto_object", {"R", "G", "B", "A"});
  Image materials = two_pixels("crypto_material", {"R", "G", "B", "A"});
  materials.pixels[1] = 0.5f;
  Image both = make_image(2, 1, {});
  both.channels = image.channels;
  both.channels.insert(both.channels.end(), materials.channels.begin(), materials.channels.end());
  for (std::size_t pixel = 0; pixel < 2; ++pixel)
    for (const Image* part : {&image, &materials})
      both.pixels.insert(both.pixels.end(), &part->pixels[8 * pixel], &part->pixels[8 * pixel] + 8);
  both.attributes = image.attributes;
  both.attributes.push_back({"cryptomatte/7654321/name", std::string("crypto_material")});
  both.attributes.push_back({"cryptomatte/7654321/manifest", image.attributes[1].value});
  const auto elk = extract_matte(both, "elk", "f.exr");
  ASSERT_FALSE(elk);
  EXPECT_NE(elk.error().message.find("write crypto_object.elk or crypto_material.elk"),
            std::string::npos)
      << elk.error().message;
  EXPECT_EQ(extract_matte(both, "crypto_material.elk", "f.exr")->pixels, grey(0.5f, 0.125f));
  EXPECT_EQ(extract_matte(both, "floor", "f.exr")->pixels, grey(0.0625f, 0.625f)) << "the same";
}

TEST(ExtractMatte, RefusesImagesWithoutManifest) {
  Image image = two_pixels("crypto_object", {"R", "G", "B", "A"});
  image.attributes[1].value = std::string("{\"elk\": \"no number\"}");
  EXPECT_EQ(extract_matte(image, "elk", "f.exr").error().code, ErrorCode::kInput);
  image.attributes[1].value = std::string("{\"elk");
  EXPECT_EQ(extract_matte(image, "elk", "f.exr").error().code, ErrorCode::kInput);
  image.attributes.clear();
  const auto none = extract_matte(image, "elk", "f.exr");
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("image.aovs=crypto_object"), std::string::npos);
}

}  // namespace
}  // namespace polymorph
