#include "render/film/cryptomatte.h"

#include <bit>
#include <map>
#include <nlohmann/json.hpp>

#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

TEST(Cryptomatte, HashesAreMurmurs) {
  // From the reference implementation's and the specification's test data.
  EXPECT_EQ(murmur_hash(""), 0u);
  EXPECT_EQ(murmur_hash("a"), 0x3c2569b2u);
  EXPECT_EQ(murmur_hash("hello"), 0x248bfa47u);
  EXPECT_EQ(murmur_hash("hello, world"), 0x149bbb7fu);
  EXPECT_EQ(murmur_hash("The quick brown fox jumps over the lazy dog"), 0x2e4ff723u);
}

TEST(Cryptomatte, IdsAreProperFloats) {
  for (int i = 0; i < 20000; ++i) {
    const float id = matte_id(std::to_string(i));
    EXPECT_TRUE(std::isnormal(id)) << i;
  }
}

TEST(Cryptomatte, RanksFallAndKeepTheLargest) {
  MattePixel pixel;
  for (int i = 0; i < 8; ++i) pixel.add(static_cast<float>(i + 1), static_cast<float>(i + 1));
  pixel.add(3, 6);  // 9 of 42
  const auto ranked = pixel.rank(42);
  EXPECT_EQ(ranked[0], 3);
  EXPECT_FLOAT_EQ(ranked[1], 9.0f / 42);
  EXPECT_EQ(ranked[2], 8);
  for (std::size_t i = 3; i < ranked.size(); i += 2) EXPECT_LE(ranked[i], ranked[i - 2]);
}

/// Coverage of a name in every pixel.
std::vector<float> coverage(const Image& image, const std::string& layer, const std::string& name) {
  std::vector<float> values(static_cast<std::size_t>(image.width) * image.height);
  const int first = image.find_channel(layer + "00.R");
  EXPECT_GE(first, 0);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int rank = 0; rank < kMatteRanks; ++rank)
        if (image.at(x, y, first + 2 * rank) == matte_id(name))
          values[static_cast<std::size_t>(y * image.width + x)] +=
              image.at(x, y, first + 2 * rank + 1);
  return values;
}

double sum_of(const std::vector<float>& values) {
  double sum = 0;
  for (const float value : values) sum += static_cast<double>(value);
  return sum;
}

struct MatteStage : BallOnFloor {
  RenderSettings settings = small_settings(64);
  MatteStage() {
    scene.meshes[0].name = "ball";
    ball.materials[0].name = "skin";
    scene.meshes[0].materials = ball.materials;
    settings.image.aovs = "crypto_object,crypto_material,crypto_label";
  }
};

TEST(Cryptomatte, CoveragesSumToOneAndMatchThePicture) {
  MatteStage stage;
  // A white ball alone before black: its coverage is its brightness.
  stage.scene.ground.enabled = false;
  stage.scene.environment = constant_sky(0);
  stage.scene.lights.key_intensity = 0;
  stage.scene.lights.lamps.clear();
  const Image image = render_or_fail(stage.scene, stage.settings);
  const auto ball = coverage(image, "crypto_object", "ball"),
             backdrop = coverage(image, "crypto_object", "backdrop");
  int partly = 0;
  for (std::size_t i = 0; i < ball.size(); ++i) {
    EXPECT_NEAR(ball[i] + backdrop[i], 1, 1e-6f);
    partly += ball[i] > 0.01f && ball[i] < 0.99f;
  }
  EXPECT_GT(partly, 30);
  stage.settings.image.transparent = true;
  const Image cut = render_or_fail(stage.scene, stage.settings);
  const auto cut_ball = coverage(cut, "crypto_object", "ball");
  for (std::size_t i = 0; i < ball.size(); ++i) {
    EXPECT_NEAR(cut_ball[i], cut.pixels[i * cut.channel_count() + 3], 1e-6f) << "is alpha";
    EXPECT_EQ(cut_ball[i], ball[i]);
  }
  EXPECT_EQ(sum_of(coverage(cut, "crypto_object", "backdrop")), 0);
}

TEST(Cryptomatte, AFadingFloorSharesWithTheBackdrop) {
  MatteStage stage;
  stage.settings.image.transparent = true;
  const Image image = render_or_fail(stage.scene, stage.settings);
  const auto ball = coverage(image, "crypto_object", "ball"),
             ground = coverage(image, "crypto_object", "ground");
  EXPECT_GT(sum_of(ground), 100);
  for (std::size_t i = 0; i < ball.size(); ++i)
    EXPECT_NEAR(ball[i] + ground[i], image.pixels[i * image.channel_count() + 3], 1e-3f);
}

TEST(Cryptomatte, MaterialsAreMixedAsTheyLook) {
  MatteStage stage;
  RenderMesh& mesh = stage.scene.meshes[0];
  std::vector<Material> other{matte({1, 0, 0})};
  other[0].name = "coat";
  MixedLayer over;
  over.materials = other;
  over.opacity = 0.25f;
  mesh.upper_layers = {over};
  mesh.look = 0.5f;
  const Image image = render_or_fail(stage.scene, stage.settings);
  const double ball = sum_of(coverage(image, "crypto_object", "ball"));
  EXPECT_NEAR(sum_of(coverage(image, "crypto_material", "look")), 0.5 * ball, 1e-3 * ball);
  EXPECT_NEAR(sum_of(coverage(image, "crypto_material", "coat")), 0.125 * ball, 1e-3 * ball);
  EXPECT_NEAR(sum_of(coverage(image, "crypto_material", "skin")), 0.375 * ball, 1e-3 * ball);
}

TEST(Cryptomatte, LabelsAreThoseOfTheNearestVertex) {
  MatteStage stage;
  std::vector<std::uint32_t> labels;
  for (const Vec3& p : stage.ball.positions) labels.push_back(p.y > 0 ? 1 : 0);
  stage.scene.meshes[0].vertex_labels = labels;
  stage.scene.meshes[0].label_names = {"lower", "upper"};
  const Image image = render_or_fail(stage.scene, stage.settings);
  const double upper = sum_of(coverage(image, "crypto_label", "upper")),
               lower = sum_of(coverage(image, "crypto_label", "lower"));
  EXPECT_NEAR(upper + lower, sum_of(coverage(image, "crypto_object", "ball")), 1e-3);
  EXPECT_GT(upper, 100);
  EXPECT_GT(lower, 50);
}

TEST(Cryptomatte, LensAndShutterSmearMattesLikeTheColours) {
  MatteStage stage;
  stage.scene.ground.enabled = false;
  stage.settings.image.transparent = true;
  const std::vector<Vec3> way(stage.ball.positions.size(), Vec3{0.8f, 0, 0});
  const auto soft = [](const std::vector<float>& values) {
    return std::count_if(values.begin(), values.end(),
                         [](float v) { return v > 0.02f && v < 0.98f; });
  };
  const Image sharp = render_or_fail(stage.scene, stage.settings);
  stage.scene.camera.shutter = 1;
  stage.scene.meshes[0].displacement = way;
  stage.scene.camera.lens_radius = 0.05f;
  stage.scene.camera.focus = 1;
  const Image smeared = render_or_fail(stage.scene, stage.settings);
  const auto ball = coverage(smeared, "crypto_object", "ball");
  EXPECT_GT(soft(ball), 2 * soft(coverage(sharp, "crypto_object", "ball")));
  for (std::size_t i = 0; i < ball.size(); ++i)
    EXPECT_NEAR(ball[i], smeared.pixels[i * smeared.channel_count() + 3], 1e-5f);
}

TEST(Cryptomatte, TheHeaderSaysHowToReadIt) {
  const MatteStage stage;
  const Image image = render_or_fail(stage.scene, stage.settings);
  std::map<std::string, std::string> entries;
  for (const Attribute& attribute : image.attributes)
    entries[attribute.name] = std::get<std::string>(attribute.value);
  ASSERT_EQ(entries.size(), 12u);
  const std::string prefix =
      "cryptomatte/" + fmt::format("{:08x}", murmur_hash("crypto_object")).substr(0, 7) + "/";
  EXPECT_EQ(entries[prefix + "name"], "crypto_object");
  EXPECT_EQ(entries[prefix + "hash"], "MurmurHash3_32");
  EXPECT_EQ(entries[prefix + "conversion"], "uint32_to_float32");
  const auto manifest = nlohmann::json::parse(entries[prefix + "manifest"]);
  EXPECT_EQ(manifest["ball"],
            fmt::format("{:08x}", std::bit_cast<std::uint32_t>(matte_id("ball"))));
  EXPECT_TRUE(manifest.contains("ground"));
}

TEST(Cryptomatte, AMeshWithoutLabelsIsOneLabelOfItsName) {
  const MatteStage stage;
  const Image image = render_or_fail(stage.scene, stage.settings);
  EXPECT_GT(sum_of(coverage(image, "crypto_label", "ball")), 1);
  const std::string prefix =
      "cryptomatte/" + fmt::format("{:08x}", murmur_hash("crypto_label")).substr(0, 7) + "/";
  for (const Attribute& attribute : image.attributes)
    if (attribute.name == prefix + "manifest") {
      const auto manifest = nlohmann::json::parse(std::get<std::string>(attribute.value));
      EXPECT_TRUE(manifest.contains("ball"));
      return;
    }
  FAIL() << "no manifest";
}

}  // namespace
}  // namespace polymorph
