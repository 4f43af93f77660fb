// Clear dielectrics.
#include "render/materials/glass.h"

#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

TEST(Glass, FresnelIsThatOfTheTextbooks) {
  EXPECT_NEAR(dielectric_fresnel(1, 1 / 1.5f), 0.04f, 1e-5f);
  EXPECT_NEAR(dielectric_fresnel(1, 1.5f), 0.04f, 1e-5f);
  EXPECT_EQ(dielectric_fresnel(0, 1 / 1.5f), 1);
  // Beyond the critical angle, asin(1 / 1.5) = 41.8 degrees, all comes back.
  EXPECT_EQ(dielectric_fresnel(std::cos(radians(42.0f)), 1.5f), 1);
  EXPECT_LT(dielectric_fresnel(std::cos(radians(41.0f)), 1.5f), 0.6f);
  // At Brewster's angle, atan(1.5), only half of the light is there to be reflected: the other
  // polarisation goes through whole. r_s = cos(2 b).
  const float brewster = std::atan(1.5f);
  EXPECT_NEAR(dielectric_fresnel(std::cos(brewster), 1 / 1.5f),
              0.5f * square(std::cos(2 * brewster)), 1e-5f);
}

TEST(Glass, LightBendsBySnellAndBackAgain) {
  const Vec3 normal{0, 0, 1};
  for (const float degrees : {0.0f, 20.0f, 50.0f, 80.0f}) {
    const float a = radians(degrees);
    const Vec3 in{std::sin(a), 0, -std::cos(a)};
    const Vec3 inside = refracted(in, normal, 1 / 1.5f);
    EXPECT_NEAR(inside.x, in.x / 1.5f, 1e-5f) << degrees;
    EXPECT_NEAR(length(refracted(inside, normal, 1.5f) - in), 0, 1e-4f);
  }
}

RenderScene glass_ball(TestMesh& ball, float sky) {
  ball.materials[0].transmission = 1;
  ball.materials[0].color = {1, 1, 1};
  ball.materials[0].roughness = 0;
  RenderScene scene = furnace(sky);
  scene.meshes = {view_of(ball)};
  return scene;
}

TEST(Glass, LosesNoLightInAWhiteFurnace) {
  TestMesh ball = make_ball(192, 96);
  RenderScene scene = glass_ball(ball, 1);
  for (const float roughness : {0.0f, 0.3f}) {
    ball.materials[0].roughness = roughness;
    const Image image = render_or_fail(scene, small_settings(32));
    // What is trapped beyond the last boundary of a path is all that may be missing.
    EXPECT_NEAR(mean_green(image), 1, 0.01) << roughness;
  }
  // Its colour is what light keeps that goes through once: in and out.
  ball.materials[0].roughness = 0;
  ball.materials[0].color = {0.25f, 0.25f, 0.25f};
  const Image tinted = render_or_fail(scene, small_settings(256));
  const float through = 0.96f * 0.25f * 0.96f;
  EXPECT_NEAR(tinted.at(24, 18, 1), 0.04f + through, 0.02f);
}

TEST(Glass, ThrowsAShadowOfItsColour) {
  TestMesh pane = make_square({0, 1, 0}, {1, 0, 0}, {0, 0, -1}, 5);
  pane.materials[0].transmission = 1;
  pane.materials[0].color = {1, 0.25f, 0.25f};
  TestMesh plane = make_square({}, {1, 0, 0}, {0, 0, -1}, 5);
  plane.materials = {matte({0.5f, 0.5f, 0.5f})};
  RenderScene scene = furnace(0);
  scene.meshes = {view_of(plane), view_of(pane, 3)};
  look_down(scene.camera, 0.5f);
  scene.lights.key_elevation = 90;
  scene.lights.key_intensity = 2;
  scene.lights.key_color = {1, 1, 1};
  const Image image = render_or_fail(scene, small_settings(16));
  // One boundary: the root of the colour, and 4 % thrown back.
  const float open = 0.5f * 2 / std::numbers::pi_v<float>;
  EXPECT_NEAR(image.at(24, 18, 0), 0.96f * open, 0.03f * open);
  EXPECT_NEAR(image.at(24, 18, 1), 0.96f * 0.5f * open, 0.03f * open);
}

TEST(Glass, SomewhereInTheSceneChangesNoLightElsewhere) {
  // Between two large plates over a floor it is dark: the ground that the last rays of paths take
  // for the sky's lower half is hidden by the lower plate.
  TestMesh lower = make_square({}, {1, 0, 0}, {0, 0, -1}, 50);
  TestMesh upper = make_square({0, 1, 0}, {1, 0, 0}, {0, 0, 1}, 50);
  lower.materials = {matte({0, 0, 0})};
  upper.materials = {matte({0.8f, 0.8f, 0.8f})};
  RenderScene scene = furnace(1);
  scene.ground.enabled = true;
  scene.ground.height = -1;
  scene.meshes = {view_of(lower), view_of(upper, 3)};
  scene.camera.position = {0, 0.2f, 0};
  scene.camera.forward = {0, 1, 0};
  scene.camera.up = {0, 0, 1};
  RenderSettings settings = small_settings(64);
  settings.image.max_depth = 2;
  const double opaque = mean_green(render_or_fail(scene, settings));
  EXPECT_LT(opaque, 0.05);
  TestMesh pane = make_square({0, 10, 0}, {1, 0, 0}, {0, 0, -1}, 1);
  pane.materials[0].transmission = 1;
  scene.meshes.push_back(view_of(pane, 4));
  EXPECT_NEAR(mean_green(render_or_fail(scene, settings)), opaque, 1e-4);
}

}  // namespace
}  // namespace polymorph
