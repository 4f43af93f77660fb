#include "render/film/part.h"

#include <cstring>

#include "image/image_io.h"
#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

/// A ball of half glass over a floor, seen by a lens while it moves.
struct MovingBall : BallOnFloor {
  std::vector<Vec3> displacement;
  MovingBall() {
    displacement.assign(ball.positions.size(), {0.4f, 0.1f, 0});
    scene.meshes.front().displacement = displacement;
    scene.meshes.front().name = "ball";
    scene.meshes.front().look = 0.3f;
    scene.look.kind = LookKind::kGlass;
    scene.camera.shutter = 0.5f;
    scene.camera.lens_radius = 0.1f;
    scene.camera.focus = 4;
  }
};

RenderSettings make_settings(int samples, const std::string& aovs) {
  RenderSettings settings = small_settings(samples);
  settings.image.aovs = aovs;
  return settings;
}

/// A part as it is after it was written and read.
Part render_part(const RenderScene& scene, RenderSettings settings, const std::string& samples) {
  settings.part = *parse_sample_range(samples);
  const Image image = render_or_fail(scene, settings);
  const auto bytes = encode_exr(image);
  EXPECT_TRUE(bytes);
  auto read = decode_image(*bytes, samples);
  EXPECT_TRUE(read) << read.error().message;
  read->attributes = image.attributes;
  return {samples, *settings.part, *std::move(read)};
}

Part merge_to_part(const Part& a, const Part& b) {
  const std::vector<Part> parts{a, b};
  auto image = merge_parts(parts);
  EXPECT_TRUE(image) << image.error().message;
  return {
      a.name + "+" + b.name, {a.samples.first, b.samples.end, a.samples.total}, *std::move(image)};
}

::testing::AssertionResult has_same_bits(const Image& a, const Image& b) {
  if (a.channels != b.channels)
    return ::testing::AssertionFailure()
           << fmt::format("{} and {}", fmt::join(a.channels, ","), fmt::join(b.channels, ","));
  if (a.pixels.size() != b.pixels.size()) return ::testing::AssertionFailure() << "sizes";
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    if (std::memcmp(&a.pixels[i], &b.pixels[i], sizeof(float)) != 0)
      return ::testing::AssertionFailure()
             << a.channels[i % a.channel_count()] << ": " << a.pixels[i] << " and " << b.pixels[i];
  return ::testing::AssertionSuccess();
}

void expect_merges(const RenderScene& scene, const RenderSettings& settings,
                   const std::vector<std::string>& ranges) {
  const Image whole = render_or_fail(scene, settings);
  std::vector<Part> parts;
  for (const std::string& range : ranges) parts.push_back(render_part(scene, settings, range));
  const auto merged = merge_parts(parts);
  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_TRUE(has_same_bits(*merged, whole));
}

TEST(Part, MergesToTheBitsOfThePicture) {
  const MovingBall moving;
  const RenderSettings settings = make_settings(64, "all");
  expect_merges(moving.scene, settings, {"0-31/64", "32-63/64"});
  expect_merges(moving.scene, settings, {"0-15/64", "16-31/64", "32-47/64", "48-63/64"});
  expect_merges(moving.scene, settings, {"0-47/64", "48-63/64"});
  expect_merges(moving.scene, settings, {"0-63/64"});
}

TEST(Part, MergesInAnyGrouping) {
  const MovingBall moving;
  const RenderSettings settings = make_settings(80, "Z,crypto_material,crypto_object");
  const Image whole = render_or_fail(moving.scene, settings);
  std::vector<Part> parts;
  for (const char* range : {"0-15/80", "16-31/80", "32-47/80", "48-63/80", "64-79/80"})
    parts.push_back(render_part(moving.scene, settings, range));
  const Part middle = merge_to_part(parts[1], parts[2]);
  EXPECT_FALSE(middle.samples.is_whole());
  const Part left = merge_to_part(parts[0], middle), right = merge_to_part(parts[3], parts[4]);
  EXPECT_TRUE(has_same_bits(merge_to_part(left, right).image, whole));
  const Part most = merge_to_part(middle, right);
  EXPECT_TRUE(has_same_bits(merge_to_part(parts[0], most).image, whole));
  // A larger part is the one that is rendered at once.
  EXPECT_TRUE(has_same_bits(
      select_channels(render_part(moving.scene, settings, "16-47/80").image, middle.image.channels),
      middle.image));
}

TEST(Part, HasAShortLastBlock) {
  const MovingBall moving;
  expect_merges(moving.scene, make_settings(40, "none"), {"0-15/40", "16-39/40"});
}

TEST(Part, MergesTransparentPicturesAndShadows) {
  MovingBall moving;
  moving.scene.ground.shadow_only = true;
  RenderSettings settings = make_settings(32, "crypto_object");
  settings.image.transparent = true;
  expect_merges(moving.scene, settings, {"0-15/32", "16-31/32"});
}

TEST(Part, IsSmoothedAfterMerging) {
  const BallOnFloor still;
  RenderSettings settings = make_settings(32, "none");
  settings.image.smooth = true;
  const Image smooth = render_or_fail(still.scene, settings);
  expect_merges(still.scene, settings, {"0-15/32", "16-31/32"});
  settings.image.smooth = false;
  EXPECT_FALSE(has_same_bits(smooth, render_or_fail(still.scene, settings)));
}

TEST(Part, HasChannelsOfLongNames) {
  const MovingBall moving;
  const Part part =
      render_part(moving.scene, make_settings(65536, "crypto_material"), "65520-65535/65536");
  EXPECT_GE(part.image.find_channel("s65520-65535.crypto_material.0.sum"), 0);
}

TEST(Part, SaysWhatIsWrong) {
  const MovingBall moving;
  const RenderSettings settings = make_settings(32, "Z");
  const Part first = render_part(moving.scene, settings, "0-15/32");
  const auto message = [&](const Part& second) {
    const std::vector<Part> parts{first, second};
    const auto merged = merge_parts(parts);
    return merged ? std::string() : merged.error().message;
  };
  Part second = render_part(moving.scene, settings, "16-31/32");
  EXPECT_EQ(message(second), "");
  Part other = second;
  other.image.pixels[static_cast<std::size_t>(other.image.find_channel("Z"))] = 1;
  EXPECT_NE(message(other).find("layer Z differs"), std::string::npos) << message(other);
  other = second;
  other.image.channels[static_cast<std::size_t>(other.image.find_channel("s16-31.lit"))] = "x";
  EXPECT_NE(message(other).find("s16-31.lit is missing"), std::string::npos) << message(other);
  other = second;
  other.image = make_image(3, 2, second.image.channels);
  EXPECT_NE(message(other).find("is 3 x 2"), std::string::npos) << message(other);
}

}  // namespace
}  // namespace polymorph
