// Lamps, panels, suns and the day sky: their light against what geometry says.
#include "render/lights/lamps.h"

#include "render/lights/day_sky.h"
#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

/// Irradiance by the lamp on a surface at the origin with normal +y, from n x n samples.
double irradiance(const Lamp& lamp, int n) {
  double sum = 0;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const LampSample s =
          sample_lamp(lamp, Vec3{}, (static_cast<float>(i) + 0.5f) / static_cast<float>(n),
                      (static_cast<float>(j) + 0.5f) / static_cast<float>(n));
      sum += static_cast<double>(s.power.y * std::max(0.0f, s.direction.y));
    }
  return sum / n / n;
}

TEST(Lamps, GiveTheirIntensityAtTheTarget) {
  LampSettings settings;
  settings.target = Vec3{};
  settings.position = {0, 5, 0};
  settings.intensity = 3;
  for (const float radius : {0.0f, 0.2f, 2.0f}) {
    settings.radius = radius;
    // A ball's irradiance is pi L (r / d)^2 however near it is.
    EXPECT_NEAR(irradiance(make_lamp(settings, {}), 64), 3, 0.003) << radius;
  }
  settings.kind = LampKind::kPanel;
  settings.width = settings.height = 0.1f;
  EXPECT_NEAR(irradiance(make_lamp(settings, {}), 16), 3, 0.003);
  // A near square panel: 4 times the configuration factor of a parallel plate over its corner
  // (Howell, catalog of radiation configuration factors, B-4).
  settings.width = settings.height = 4;
  const double x = 2.0 / 5;
  const double root = std::sqrt(1 + x * x);
  const double factor = 4 / (2 * std::numbers::pi) * 2 * (x / root * std::atan(x / root));
  EXPECT_NEAR(irradiance(make_lamp(settings, {}), 128), 3 * 25.0 / 16 * std::numbers::pi * factor,
              0.005);
}

TEST(Lamps, SamplesPointAtTheLampAndKnowTheirDensity) {
  LampSettings ball;
  ball.position = {1, 2, 0.5f};
  ball.target = Vec3{};
  ball.radius = 0.7f;
  LampSettings panel = ball;
  panel.kind = LampKind::kPanel;
  panel.width = 1.5f;
  for (const LampSettings& settings : {ball, panel}) {
    const Lamp lamp = make_lamp(settings, {});
    for (int i = 0; i < 100; ++i) {
      const float u = static_cast<float>(i % 10) / 10 + 0.03f,
                  v = (static_cast<float>(i) + 0.5f) / 101;
      const LampSample s = sample_lamp(lamp, Vec3{0.1f, 0, 0}, u, v);
      ASSERT_GT(s.pdf, 0);
      const Ray ray{{0.1f, 0, 0}, s.direction};
      const float hit = intersect_lamp(lamp, ray);
      if (settings.kind == LampKind::kLamp && !(hit < 100)) continue;  // on the very rim
      EXPECT_NEAR(hit, s.distance, 1e-3f);
      EXPECT_NEAR(lamp_pdf(lamp, ray, hit) / s.pdf, 1, 1e-3f);
    }
    EXPECT_FALSE(intersect_lamp(lamp, Ray{{0.1f, 0, 0}, {0, -1, 0}}) < 100);
  }
  EXPECT_EQ(sample_lamp(make_lamp(panel, {}), Vec3{2, 4, 1}, 0.5f, 0.5f).power.x, 0)
      << "its dark side";
}

TEST(Lamps, AMirrorAndAMattePlateAgreeOnAPanelHoweverItIsFound) {
  // A rough metal plate under a panel: light found by sampling the panel and by hitting it share
  // the work. At roughness 1 and 0.05 the plate's mean light must be the same with many samples
  // as with few, and above nothing.
  TestMesh plane = make_square({}, {1, 0, 0}, {0, 0, -1}, 50);
  RenderScene scene = furnace(0);
  scene.look.color = {1, 1, 1};
  scene.meshes = {view_of(plane)};
  scene.meshes[0].look = 1;
  scene.camera.position = {0, 3, 3};
  scene.camera.forward = normalized(Vec3{0, -1, -1});
  scene.camera.right = {1, 0, 0};
  scene.camera.up = cross(scene.camera.right, scene.camera.forward);
  LampSettings panel;
  panel.kind = LampKind::kPanel;
  panel.position = {0, 3, -3};
  panel.target = Vec3{};
  panel.width = panel.height = 4;
  scene.lights.lamps = {panel};
  for (const float roughness : {0.15f, 0.4f, 1.0f}) {
    scene.look.roughness = roughness;
    const double few = mean_green(render_or_fail(scene, small_settings(16)));
    const double many = mean_green(render_or_fail(scene, small_settings(512)));
    EXPECT_GT(many, 0.01) << roughness;
    EXPECT_NEAR(few / many, 1, 0.04) << roughness;
  }
  // A mirror shows the panel itself: radiance = intensity d^2 / area.
  scene.look.roughness = 0;
  const Image mirror = render_or_fail(scene, small_settings(16));
  EXPECT_NEAR(mirror.at(24, 18, 1), 18.0f / 16, 0.01f);
}

TEST(Lamps, ASecondSunAddsItsIrradiance) {
  TestMesh plane = make_square({}, {1, 0, 0}, {0, 0, -1}, 100);
  plane.materials = {matte({0.5f, 0.5f, 0.5f})};
  RenderScene scene = furnace(0);
  scene.meshes = {view_of(plane)};
  look_down(scene.camera, 3);
  LampSettings sun;
  sun.kind = LampKind::kSun;
  sun.elevation = 30;
  sun.intensity = 2;
  scene.lights.lamps = {sun};
  EXPECT_NEAR(mean_green(render_or_fail(scene, small_settings(16))), 0.5 * 2 * 0.5 / kPi, 0.003);
}

TEST(DaySky, IsBlueAboveBrightByTheSunAndGivesItsIrradiance) {
  LightSettings lights;
  lights.key_elevation = 35;
  const DistantLight sun = make_key_light(lights, Camera{});
  for (const float turbidity : {2.0f, 3.0f, 6.0f}) {
    const Sky sky = make_day_sky(sun, {0.4f, 0.4f, 0.4f}, turbidity, 1, SkyDomain::kAboveHorizon);
    EXPECT_NEAR(luminance(sky.upper_irradiance), kDayIrradiance, 0.03f);
    const Vec3 zenith = sky_radiance(sky, Vec3{0, 1, 0});
    EXPECT_GT(zenith.z, 1.2f * zenith.x) << turbidity;
    const Vec3 by_sun = sky_radiance(sky, sun.frame.z);
    EXPECT_GT(luminance(by_sun), 1.5f * luminance(zenith));
    const Vec3 down = sky_radiance(sky, Vec3{0, -1, 0});
    EXPECT_NEAR(down.y, 0.4f * (sun.irradiance.y * sun.frame.z.y + sky.upper_irradiance.y) / kPi,
                0.02f)
        << "the ground is lit by this very sky";
  }
  lights.key_elevation = -5;
  const Sky dusk = make_day_sky(make_key_light(lights, Camera{}), {}, 3, 1, SkyDomain::kAll);
  for (const Vec3& texel : dusk.texels) ASSERT_TRUE(finite(texel));
}

}  // namespace
}  // namespace polymorph
