// Lens, shutter, adaptive samples, alpha and layers.
#include <algorithm>

#include "render/aov.h"
#include "render/film/cryptomatte.h"
#include "render/film/film.h"
#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

/// A white square of half size `half` at distance `distance` before a black background.
struct Target {
  TestMesh mesh;
  RenderScene scene;
  Target(float half, float z) : mesh(make_square({0, 0, z}, {1, 0, 0}, {0, 1, 0}, half)) {
    mesh.materials = {matte({1, 1, 1})};
    scene = furnace(0);
    scene.meshes = {view_of(mesh)};
    scene.lights.key_intensity = 3;
    scene.lights.key_size = 0;
    scene.lights.key_azimuth = 0;
    scene.lights.key_elevation = 0;
  }
};

/// Pixels of the middle row that are neither black nor as bright as the middle.
int soft_pixels(const Image& image) {
  const float bright = image.at(image.width / 2, image.height / 2, 1);
  int soft = 0;
  for (int x = 0; x < image.width; ++x) {
    const float value = image.at(x, image.height / 2, 1);
    soft += value > 0.03f * bright && value < 0.97f * bright;
  }
  return soft;
}

TEST(Lens, BlursWhatIsOutOfFocusAndOnlyThat) {
  Target target(0.5f, 0);
  const int sharp = soft_pixels(render_or_fail(target.scene, small_settings(64)));
  target.scene.camera.lens_radius = 0.2f;
  target.scene.camera.focus = 5;
  EXPECT_LE(soft_pixels(render_or_fail(target.scene, small_settings(64))), sharp + 1);
  target.scene.camera.focus = 2.5f;
  // A point at 5 becomes a disc of radius r |5 / 2.5 - 1| = 0.2 at 5: 0.4 across on either side.
  const Image blurred = render_or_fail(target.scene, small_settings(256));
  const float pixel = 2 * 5 * target.scene.camera.tan_half_fov_y / 36;
  EXPECT_NEAR(static_cast<float>(soft_pixels(blurred)), 2 * 0.4f / pixel, 5);
}

TEST(Shutter, SmearsWhatMovesByItsWay) {
  Target target(0.4f, 0);
  const std::vector<Vec3> way(4, Vec3{0.6f, 0, 0});
  target.scene.meshes[0].displacement = way;
  RenderSettings settings = small_settings(256);
  settings.image.aovs = "motion,P";
  const Image still = render_or_fail(target.scene, settings);
  target.scene.camera.shutter = 0.5f;
  const Image moving = render_or_fail(target.scene, settings);
  const float pixel = 2 * 5 * target.scene.camera.tan_half_fov_y / 36;
  // Each of the two edges is smeared over shutter x way.
  EXPECT_NEAR(static_cast<float>(soft_pixels(moving) - soft_pixels(still)), 2 * 0.3f / pixel, 4);
  // As much light, and its middle where it was.
  EXPECT_NEAR(mean_green(moving), mean_green(still), 0.01 * mean_green(still));
  EXPECT_EQ(still.channels[7], "motion.X");
  EXPECT_NEAR(still.at(24, 18, 7), 0.6f / pixel, 0.01f);
  EXPECT_NEAR(still.at(24, 18, 8), 0, 1e-4f);
  EXPECT_EQ(moving.at(24, 18, 7), still.at(24, 18, 7)) << "layers are those of the moment itself";
}

TEST(Noise, IsReachedWithFewerSamplesThanThereMayBe) {
  const BallOnFloor stage;
  const RenderScene& scene = stage.scene;
  RenderSettings settings = small_settings(1024);
  settings.image.width = 64;
  settings.image.height = 48;
  auto renderer = Renderer::create();
  ASSERT_TRUE(renderer);
  const Image truth = *renderer->render(scene, settings);
  const auto error = [&](const Image& image) {
    double sum = 0;
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x)
        for (int c = 0; c < 3; ++c)
          sum += std::fabs(image.at(x, y, c) - truth.at(x, y, c)) /
                 (0.01f + std::sqrt(3 * truth.at(x, y, 1)));
    return sum / (64 * 48);
  };
  double before = 1;
  std::uint64_t paths = 0;
  for (const float noise : {0.08f, 0.02f, 0.005f}) {
    settings.image.noise = noise;
    const Image image = *renderer->render(scene, settings);
    EXPECT_LT(error(image), 1.1 * static_cast<double>(noise)) << noise;
    EXPECT_LT(error(image), before);
    EXPECT_GT(renderer->stats().paths, paths);
    EXPECT_LT(renderer->stats().paths, 64u * 48 * 1024 * 3 / 4);
    paths = renderer->stats().paths;
    before = error(image);
    EXPECT_EQ(image.pixels, renderer->render(scene, settings)->pixels);
  }
}

TEST(Alpha, ATransparentPictureKeepsObjectAndShadow) {
  BallOnFloor stage;
  RenderScene& scene = stage.scene;
  RenderSettings settings = small_settings(64);
  settings.image.width = 64;
  settings.image.height = 48;
  const Image opaque = render_or_fail(scene, settings);
  scene.ground.shadow_only = true;
  const Image shadow = render_or_fail(scene, settings);
  float darkest = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const float id = shadow.at(x, y, 8);
      EXPECT_EQ(opaque.at(x, y, 3), 1);
      if (id <= 1) darkest = std::max(darkest, shadow.at(x, y, 3));
      // Put on the lit ground that it was taken from, the shadow comes out as dark as it was.
      if (id == 1 && y > 40 && shadow.at(x, y, 1) == 0) {
        EXPECT_NEAR(opaque.at(x, y, 1) / opaque.at(0, 47, 1),
                    (1 - shadow.at(x, y, 3)) / (1 - shadow.at(0, 47, 3)), 0.08)
            << x << " " << y;
      }
    }
  EXPECT_EQ(shadow.at(32, 24, 3), 1) << "the ball";
  EXPECT_NEAR(shadow.at(32, 24, 1), opaque.at(32, 24, 1), 0.02f);
  EXPECT_EQ(shadow.at(0, 0, 3), 0) << "no backdrop";
  EXPECT_GT(darkest, 0.5f);
  scene.ground.enabled = false;
  scene.ground.shadow_only = false;
  settings.image.transparent = true;
  const Image cut = render_or_fail(scene, settings);
  EXPECT_EQ(cut.at(0, 47, 3), 0);
  EXPECT_EQ(cut.at(32, 24, 3), 1);
}

TEST(Layers, AreThoseThatWereAskedFor) {
  Target target(1, 0);
  target.scene.meshes[0].progress = 0.25f;
  target.scene.time = 0.5f;
  target.mesh.materials[0].color = {0.5f, 0.25f, 0.125f};
  RenderSettings settings = small_settings(1);
  settings.image.aovs = "all";
  const Image all = render_or_fail(target.scene, settings);
  ASSERT_EQ(all.channels.size(), 4u + 18 + 3 * 12);
  const auto at = [&](const char* name) { return all.at(24, 18, all.find_channel(name)); };
  EXPECT_NEAR(at("P.X"), at("uv.U") * 2 - 1, 1e-4f);
  EXPECT_NEAR(at("P.Y"), at("uv.V") * 2 - 1, 1e-4f);
  EXPECT_EQ(at("albedo.G"), 0.25f);
  EXPECT_EQ(at("morph.blend"), 0.25f);
  EXPECT_EQ(at("morph.t"), 0.5f);
  settings.image.aovs = "none";
  EXPECT_EQ(render_or_fail(target.scene, settings).channels.size(), 4u);
}

TEST(Layers, ThoseThatAreKnownAreThoseThatAreMade) {
  for (const std::string& name : kAovNames)
    EXPECT_NE(choose_aovs(name).empty(), Mattes(name, {}).channels().empty()) << name;
  for (const Aov& aov : kAovs)
    EXPECT_NE(std::find(kAovNames.begin(), kAovNames.end(), aov.layer), kAovNames.end())
        << aov.layer;
  EXPECT_EQ(choose_aovs("all").size(), std::size(kAovs));
  EXPECT_TRUE(choose_aovs("none").empty());
  EXPECT_TRUE(Mattes("none", {}).channels().empty());
}

}  // namespace
}  // namespace polymorph
