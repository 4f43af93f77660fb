// SHA-256 of small frames, the same on every processor: whatever rounds a product and a sum as one,
// or leaves the order of sums, changes them. What a scene can say is in one of them.
#include "testing/digest.h"
#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

std::string frame(const RenderScene& scene, RenderSettings settings) {
  settings.image.aovs = "all";
  const Image image = render_or_fail(scene, settings);
  EXPECT_GT(mean_green(image), 0.01);
  Digest digest;
  digest.add(image.pixels);
  return digest.hex();
}

TEST(FrameDigests, MetalWithColorsInTheStudio) {
  BallOnFloor studio;
  studio.scene.look.kind = LookKind::kMetal;
  studio.scene.meshes[0].look = 0.4f;
  std::vector<Vec3> colors;
  for (const Vec3& p : studio.ball.positions) colors.push_back(p * 0.5f + Vec3{0.5f, 0.5f, 0.5f});
  studio.scene.meshes[0].vertex_colors = colors;
  studio.scene.meshes[0].vertex_color_opacity = 0.7f;
  EXPECT_EQ(frame(studio.scene, small_settings(8)), "db6aa717003f366f");
}

TEST(FrameDigests, MovingGlassThroughALensBesideATexture) {
  BallOnFloor studio;
  studio.scene.look.kind = LookKind::kGlass;
  studio.scene.look.roughness = 0.2f;
  studio.scene.meshes[0].look = 1;
  const std::vector<Vec3> displacement(studio.ball.positions.size(), Vec3{0.3f, 0.1f, 0});
  studio.scene.meshes[0].displacement = displacement;
  const TestMesh square = make_checkered_square();
  studio.scene.meshes.push_back(view_of(square, 3));
  studio.scene.camera.lens_radius = 0.1f;
  studio.scene.camera.focus = 4;
  studio.scene.camera.shutter = 0.5f;
  studio.scene.lights.lamps = {make_lamp(LampKind::kPanel, {1, 2, 1}),
                               make_lamp(LampKind::kLamp, {-1, 1, 1})};
  EXPECT_EQ(frame(studio.scene, small_settings(8)), "4ca5aa0b4b35b161");
}

TEST(FrameDigests, PlasticUnderTheSkyOfADay) {
  BallOnFloor studio;
  studio.scene.lights.sky = SkyKind::kDay;
  studio.scene.lights.lamps = {make_lamp(LampKind::kSun, {})};
  studio.scene.ground.shadow_only = true;
  RenderSettings settings = small_settings(64);
  settings.image.noise = 0.05f;  // some pixels take fewer samples
  settings.frame = 3;
  EXPECT_EQ(frame(studio.scene, settings), "144cf89a21da1350");
}

}  // namespace
}  // namespace polymorph
