#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "testing/render.h"
#include "testing/texture.h"

namespace polymorph {
namespace {

using namespace testing;

/// A floor, an occluder and two objects under the studio's light: all code paths at once.
struct StudioScene {
  TestMesh ball = make_ball(48, 24, 0.7f);
  TestMesh square = make_square({0.9f, 0.2f, -0.4f}, {0, 0, -1}, {0, 1, 0}, 0.6f);
  RenderScene scene;
  StudioScene() {
    RenderMesh a = view_of(ball, 2), b = view_of(square, 3);
    a.look = 0.5f;
    scene.meshes = {a, b};
    scene.bounds = {{-1, -0.7f, -1}, {1, 1, 1}};
    scene.ground.height = -0.71f;
    scene.camera = make_camera({}, scene.bounds, 48, 36);
  }
};

TEST(Render, WhiteObjectsVanishInAWhiteFurnace) {
  TestMesh ball = make_ball(192, 96);
  RenderScene scene = furnace();
  scene.meshes = {view_of(ball)};
  const auto deviation = [&](const Image& image) {
    float largest = 0;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        largest = std::max(largest, std::fabs(image.at(x, y, 1) - 1));
    return largest;
  };
  ball.materials = {matte({1, 1, 1})};
  scene.meshes = {view_of(ball)};
  const Image diffuse = render_or_fail(scene, small_settings());
  EXPECT_NEAR(mean_green(diffuse), 1, 0.002);
  EXPECT_LT(deviation(diffuse), 0.03f);

  scene.look.color = {1, 1, 1};
  scene.meshes[0].look = 1;
  for (float roughness : {0.05f, 0.4f, 0.9f}) {
    scene.look.roughness = roughness;
    const Image metal = render_or_fail(scene, small_settings(64));
    EXPECT_NEAR(mean_green(metal), 1, 0.004) << roughness;
  }
  ball.materials[0].specular = {0.04f, 0.04f, 0.04f};
  ball.materials[0].roughness = 0.3f;
  scene.meshes = {view_of(ball)};
  EXPECT_NEAR(mean_green(render_or_fail(scene, small_settings(64))), 1, 0.004);
}

TEST(Render, DiffusePlaneHasTheIrradianceOfTheDisc) {
  TestMesh plane = make_square({}, {1, 0, 0}, {0, 0, -1}, 100);
  plane.materials = {matte({0.5f, 0.5f, 0.5f})};
  RenderScene scene = furnace(0);
  scene.meshes = {view_of(plane)};
  look_down(scene.camera, 5);
  scene.lights.key_intensity = 2;
  scene.lights.key_color = {1, 1, 1};
  for (float elevation : {30.0f, 60.0f, 90.0f}) {
    scene.lights.key_elevation = elevation;
    const double expected = 0.5 / kPi * 2 * std::sin(elevation * kPi / 180);
    EXPECT_NEAR(mean_green(render_or_fail(scene, small_settings())), expected, 0.003 * expected);
    // The floor is the same plane, seen by other code.
    RenderScene on_floor = scene;
    on_floor.meshes.clear();
    on_floor.ground = {true, 0.0f, {0.5f, 0.5f, 0.5f}};
    on_floor.bounds = {{-50, 0, -50}, {50, 1, 50}};
    EXPECT_NEAR(mean_green(render_or_fail(on_floor, small_settings())), expected, 0.003 * expected);
    RenderSettings without_paths = small_settings();
    without_paths.image.max_depth = 0;
    for (const RenderScene* plain : {&scene, &on_floor})
      EXPECT_NEAR(mean_green(render_or_fail(*plain, without_paths)), expected, 0.003 * expected);
  }
}

TEST(Render, AnOccluderThrowsAShadowWithAPenumbra) {
  TestMesh plane = make_square({}, {1, 0, 0}, {0, 0, -1}, 100);
  plane.materials = {matte({0.5f, 0.5f, 0.5f})};
  TestMesh lid = make_square({1.5f, 2, 0}, {1, 0, 0}, {0, 0, -1}, 1.5f);
  lid.materials = {matte({})};
  RenderScene scene = furnace(0);
  scene.meshes = {view_of(plane), view_of(lid)};
  // From below the lid, straight down; the light is overhead, so the lid's edge is above x = 0.
  look_down(scene.camera, 1.5f);
  scene.lights.key_elevation = 90;
  scene.lights.key_intensity = 2;
  scene.lights.key_color = {1, 1, 1};
  RenderSettings settings = small_settings(64);
  const double lit = 1 / kPi;
  const Image image = render_or_fail(scene, settings);
  EXPECT_NEAR(image.at(2, 18, 1), lit, 0.01 * lit);
  EXPECT_EQ(image.at(45, 18, 1), 0.0f);
  const double middle = 0.5 * (image.at(23, 18, 1) + image.at(24, 18, 1));
  EXPECT_NEAR(middle, 0.5 * lit, 0.06 * lit);  // half of the disc is hidden below the edge
  int partly = 0;
  for (int x = 0; x < image.width; ++x)
    partly += image.at(x, 18, 1) > 0.05 * lit && image.at(x, 18, 1) < 0.95 * lit;
  EXPECT_GE(partly, 6);
  const auto expect_hard = [&] {
    const Image hard = render_or_fail(scene, settings);
    partly = 0;
    for (int x = 0; x < hard.width; ++x)
      partly += hard.at(x, 18, 1) > 0.05 * lit && hard.at(x, 18, 1) < 0.95 * lit;
    EXPECT_LE(partly, 3);
  };
  settings.image.max_depth = 0;  // the light's centre alone
  expect_hard();
  settings.image.max_depth = 4;
  scene.lights.key_size = 0;
  expect_hard();
}

TEST(Render, WithoutPathsAnOpenSceneIsLitAsByMany) {
  // Nothing hides the even sky from a ball, so that paths only add noise; the sun's disc is small.
  TestMesh ball = make_ball(96, 48, 1);
  ball.materials = {matte({0.7f, 0.4f, 0.2f})};
  ball.materials[0].specular = {0.04f, 0.04f, 0.04f};
  ball.materials[0].roughness = 0.5f;
  RenderScene scene = furnace(1);
  scene.meshes = {view_of(ball)};
  scene.lights.key_intensity = 2;
  scene.lights.key_size = 1;
  RenderSettings settings = small_settings(256);
  const Image paths = render_or_fail(scene, settings);
  settings.image.max_depth = 0;
  settings.image.samples = 1;
  const Image direct = render_or_fail(scene, settings);
  settings.image.seed = 5;
  const Image other = render_or_fail(scene, settings);
  std::size_t inside = 0, noisy = 0;
  for (int y = 12; y < 25; ++y)
    for (int x = 17; x < 31; ++x) {
      ++inside;
      EXPECT_NEAR(direct.at(x, y, 1), paths.at(x, y, 1), 0.05f * paths.at(x, y, 1))
          << x << " " << y;
      noisy += std::abs(direct.at(x, y, 1) - other.at(x, y, 1)) > 0.05f * direct.at(x, y, 1);
    }
  EXPECT_LE(noisy, inside / 50);
}

TEST(Render, WithoutPathsMetalReflectsABrightSky) {
  TestMesh ball = make_ball(96, 48, 1);
  ball.materials = {matte({})};
  ball.materials[0].specular = {0.9f, 0.9f, 0.9f};
  ball.materials[0].roughness = 0.15f;
  RenderScene scene = furnace(0);
  scene.meshes = {view_of(ball)};
  // A patch of a tenth of the sky, far brighter than the rest.
  Image sky = make_image(32, 16, {"R", "G", "B"});
  for (std::size_t i = 0; i < sky.pixels.size(); ++i) {
    const std::size_t x = i / 3 % 32, y = i / 3 / 32;
    sky.pixels[i] = x >= 4 && x < 12 && y >= 4 && y < 8 ? 20.0f : 0.1f;
  }
  scene.environment = std::make_shared<const Image>(std::move(sky));
  RenderSettings settings = small_settings(256);
  const double paths = mean_green(render_or_fail(scene, settings));
  settings.image.max_depth = 0;
  EXPECT_NEAR(mean_green(render_or_fail(scene, settings)), paths, 0.15 * paths);
}

TEST(Render, ABallHidesItsFormFactorOfTheSkyFromTheFloor) {
  TestMesh ball = make_ball(192, 96, 0.7f);
  ball.materials = {matte({})};
  RenderScene scene = furnace(1);
  scene.meshes = {view_of(ball)};
  scene.ground = {true, -0.75f, {0.5f, 0.5f, 0.5f}};
  look_down(scene.camera, 9.25f);
  const Image image = render_or_fail(scene, small_settings(1024));
  const float pixel = 2 * scene.camera.tan_half_fov_y * 10 / static_cast<float>(image.height);
  for (int x : {32, 36, 44}) {
    // Howell, catalog of radiation configuration factors, B-38: a patch to a sphere above its
    // horizon.
    const float across = (static_cast<float>(x) + 0.5f - 24) * pixel, along = 0.5f * pixel;
    const float distance = std::sqrt(across * across + along * along + 0.75f * 0.75f);
    const float hidden = 0.75f * 0.49f / (distance * distance * distance);
    EXPECT_NEAR(image.at(x, 18, 1), 0.5f * (1 - hidden), 0.006f) << "hidden " << hidden;
  }
}

TEST(Render, NormalsAreInterpolatedBetweenVertices) {
  const TestMesh ball = make_ball(24, 12);
  RenderScene scene = furnace();
  scene.meshes = {view_of(ball)};
  const auto worst = [&](const Image& image) {
    // The normal of a unit sphere is the point itself; Z gives that point.
    float largest = 0;
    const int z = image.find_channel("Z"), n = image.find_channel("N.X");
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        if (image.at(x, y, z) > 4.5f) continue;  // not next to the outline
        const float scale = 2 * scene.camera.tan_half_fov_y / static_cast<float>(image.height);
        const float depth = image.at(x, y, z);
        const Vec3 p{(static_cast<float>(x) + 0.5f - 24) * scale * depth,
                     (18 - static_cast<float>(y) - 0.5f) * scale * depth, 5 - depth};
        const Vec3 normal{image.at(x, y, n), image.at(x, y, n + 1), image.at(x, y, n + 2)};
        EXPECT_NEAR(length(normal), 1, 1e-4f);
        largest = std::max(largest, length(normal - normalized(p)));
      }
    return largest;
  };
  EXPECT_LT(worst(render_or_fail(scene, small_settings(1))), 0.012f);
  scene.meshes[0].vertex_normals = {};
  EXPECT_GT(worst(render_or_fail(scene, small_settings(1))), 0.08f);
  // The same normals by corner.
  std::vector<Vec3> corners;
  for (const Triangle& t : ball.triangles)
    for (std::uint32_t v : t.v) corners.push_back(ball.normals[v]);
  scene.meshes[0].corner_normals = corners;
  EXPECT_LT(worst(render_or_fail(scene, small_settings(1))), 0.012f);
}

TEST(Render, TexturesHaveVUpAndMultiplyTheColor) {
  Image texture = make_image(2, 2, {"R", "G", "B"});
  const Vec3 colors[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}};  // upper row first
  for (int i = 0; i < 4; ++i) {
    texture.at(i % 2, i / 2, 0) = colors[i].x;
    texture.at(i % 2, i / 2, 1) = colors[i].y;
    texture.at(i % 2, i / 2, 2) = colors[i].z;
  }
  TestMesh square = make_square({}, {1, 0, 0}, {0, 1, 0}, 1);
  square.materials = {matte({0.5f, 0.5f, 0.5f})};
  square.materials[0].texture = 0;
  square.textures = {float_texture(texture)};
  RenderScene scene = furnace();
  scene.meshes = {view_of(square)};
  const Image image = render_or_fail(scene, small_settings());
  // The square's quarter points are the texels' centres: 0.5 of a unit from the middle.
  const float unit = 18 / (5 * scene.camera.tan_half_fov_y);
  for (int i = 0; i < 4; ++i) {
    const int x = static_cast<int>(24 + (i % 2 ? 0.5f : -0.5f) * unit);
    const int y = static_cast<int>(18 + (i / 2 ? 0.5f : -0.5f) * unit);
    const Vec3 seen = color_at(image, x, y), expected = colors[i] * 0.5f;
    EXPECT_LT(length(seen - expected), 0.06f) << "quarter " << i;
  }
}

TEST(Render, BordersOfMaterialsAreTheModelsNotTheTriangles) {
  // A square of two triangles takes over what a square of four had, whose left is red and whose
  // right, from x = 0.3 on, is green.
  Model model;
  model.points = {{-1, -1, 0}, {0.3f, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {0.3f, 1, 0}, {1, 1, 0}};
  model.triangles = {{{0, 1, 4}}, {{0, 4, 3}}, {{1, 2, 5}}, {{1, 5, 4}}};
  model.triangle_materials = {0, 0, 1, 1};
  model.materials = {matte({0.5f, 0, 0}), matte({0, 0.5f, 0})};
  const ClosestPointQuery closest(model);
  TestMesh square = make_square({}, {1, 0, 0}, {0, 1, 0}, 1);
  const TransferredMaterials taken = MaterialTransfer(model, closest, find_texture_charts(model),
                                                      {square.positions}, square.triangles)
                                         .all();
  RenderScene scene = furnace();
  scene.meshes = {view_of(square)};
  static_cast<MaterialLayer&>(scene.meshes[0]) = {
      {},
      taken.triangle_materials,
      model.materials,
      {},
      {&model, &closest, taken.borders, taken.border_index}};
  const Image image = render_or_fail(scene, small_settings());
  const float unit = 18 / (5 * scene.camera.tan_half_fov_y);
  for (const float y : {-0.7f, 0.1f, 0.8f})
    for (const float x : {-0.8f, -0.2f, 0.1f, 0.5f, 0.8f}) {
      const Vec3 seen =
          color_at(image, static_cast<int>(24 + x * unit), static_cast<int>(18 - y * unit));
      const Vec3 expected = x < 0.3f ? Vec3{0.5f, 0, 0} : Vec3{0, 0.5f, 0};
      EXPECT_LT(length(seen - expected), 0.06f) << x << ", " << y;
    }
}

TEST(Render, LookMixesOwnMaterialAndCommonLook) {
  const TestMesh ball = make_ball(48, 24);
  RenderScene scene = furnace();
  scene.lights.key_intensity = 2;
  scene.meshes = {view_of(ball)};
  const RenderSettings settings = small_settings(64);
  const Image own = render_or_fail(scene, settings);
  scene.look.color = {0.1f, 0.9f, 0.1f};
  EXPECT_EQ(render_or_fail(scene, settings).pixels, own.pixels);  // the look does not show at 0
  scene.meshes[0].look = 1;
  const Image look = render_or_fail(scene, settings);
  scene.meshes[0].materials = {};
  scene.meshes[0].look = 0;
  EXPECT_EQ(render_or_fail(scene, settings).pixels, look.pixels);  // no materials: the common look
  scene.meshes = {view_of(ball)};
  scene.meshes[0].look = 0.5f;
  const double middle = mean_green(render_or_fail(scene, settings));
  EXPECT_NEAR(middle, 0.5 * (mean_green(own) + mean_green(look)), 0.01 * middle);
}

TEST(Render, AovsHoldTheFirstHit) {
  const TestMesh ball = make_ball(96, 48),
                 wall = make_square({0, 0, -2}, {1, 0, 0}, {0, 1, 0}, 1.4f);
  RenderScene scene = furnace();
  scene.meshes = {view_of(ball, 7), view_of(wall, 9)};
  RenderSettings settings = small_settings(1);
  settings.image.width = settings.image.height = 49;
  const Image image = render_or_fail(scene, settings);
  EXPECT_EQ(image.channels,
            (std::vector<std::string>{"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "id"}));
  EXPECT_NEAR(image.at(24, 24, 4), 4, 1e-3f);
  EXPECT_NEAR(image.at(24, 24, 7), 1, 1e-3f);
  EXPECT_EQ(image.at(24, 24, 8), 7);
  // The wall behind: one distance along the view axis, wherever it is seen.
  int seen = 0;
  for (int y = 0; y < 49; ++y)
    for (int x = 0; x < 49; ++x)
      if (image.at(x, y, 8) == 9) {
        EXPECT_NEAR(image.at(x, y, 4), 7, 1e-4f);
        ++seen;
      }
  EXPECT_GT(seen, 50);
  EXPECT_EQ(image.at(0, 0, 4), 1e10f);
  EXPECT_EQ(image.at(0, 0, 8), 0);
  EXPECT_EQ(image.at(0, 0, 5), 0);
  EXPECT_EQ(image.at(0, 0, 3), 1);
  settings.image.aovs = "none";
  EXPECT_EQ(render_or_fail(scene, settings).channels,
            (std::vector<std::string>{"R", "G", "B", "A"}));
}

TEST(Render, SameImageForAnyThreadCountOrderAndCompany) {
  const StudioScene studio;
  RenderSettings settings = small_settings();
  settings.frame = 5;
  const auto in_arena = [&](int threads, Renderer& renderer) {
    tbb::task_arena arena(threads);
    return arena.execute([&] { return *renderer.render(studio.scene, settings); });
  };
  const tbb::global_control more_than_cores(tbb::global_control::max_allowed_parallelism, 5);
  Renderer first = *Renderer::create();
  const Image alone = in_arena(1, first);
  EXPECT_EQ(in_arena(2, first).pixels, alone.pixels);
  EXPECT_EQ(in_arena(5, first).pixels, alone.pixels);

  // Another frame, another scene and another light before it leave no trace.
  Renderer second = *Renderer::create();
  RenderScene other = studio.scene;
  other.meshes.pop_back();
  other.lights.key_azimuth = 70;
  RenderSettings other_settings = settings;
  other_settings.frame = 4;
  other_settings.image.samples = 3;
  ASSERT_TRUE(second.render(other, other_settings));
  EXPECT_EQ(second.render(studio.scene, settings)->pixels, alone.pixels);

  settings.frame = 6;
  EXPECT_NE(in_arena(2, first).pixels, alone.pixels);  // noise differs from frame to frame
}

TEST(Render, PinnedInstructionSetIsUsedAndRecorded) {
  Result<Renderer> renderer = Renderer::create("sse2");
  ASSERT_TRUE(renderer) << renderer.error().message;
  EXPECT_EQ(renderer->isa(), "sse2");
  EXPECT_FALSE(Renderer::create()->isa().empty());
  const StudioScene studio;
  const double pinned = mean_green(*renderer->render(studio.scene, small_settings()));
  EXPECT_NEAR(pinned, mean_green(render_or_fail(studio.scene, small_settings())), 1e-3);
}

TEST(Render, UnknownInstructionSetIsAnError) {
  const Result<Renderer> renderer = Renderer::create("avx3,verbose=3");
  ASSERT_FALSE(renderer);
  EXPECT_EQ(renderer.error().code, ErrorCode::kUsage);
  EXPECT_NE(renderer.error().message.find("avx3"), std::string::npos);
  EXPECT_NE(renderer.error().message.find("avx2"), std::string::npos);
}

TEST(Render, AnEmptyStudioShowsACalmBackdrop) {
  for (const bool ground : {false, true}) {
    RenderScene scene;
    scene.ground.enabled = ground;
    scene.bounds = {{-1, 0, -1}, {1, 2, 1}};
    scene.camera = make_camera({}, scene.bounds, 48, 36);
    const Image image = render_or_fail(scene, small_settings());
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const Vec3 c = color_at(image, x, y);
        EXPECT_GT(c.y, 0.15f);
        EXPECT_LT(c.y, 0.8f);
        EXPECT_NEAR(c.x / c.y, 1, 0.08f);  // neutral
        EXPECT_NEAR(c.z / c.y, 1, 0.08f);
        // No noise, no line.
        EXPECT_NEAR(c.y, image.at(std::max(x - 1, 0), y, 1), 0.03f);
        EXPECT_NEAR(c.y, image.at(x, std::max(y - 1, 0), 1), 0.03f);
      }
  }
}

TEST(Render, BadGeometryLeavesNoBadPixels) {
  TestMesh ball = make_ball(24, 12);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  ball.positions[30] = {nan, 0, 0};
  ball.positions[40] = {std::numeric_limits<float>::infinity(), 0, 0};
  ball.normals[50] = {};
  ball.normals[60] = {nan, nan, nan};
  ball.triangles.push_back({{70, 70, 70}});
  ball.materials[0].roughness = nan;
  ball.materials[0].color.y = nan;
  StudioScene studio;
  studio.scene.meshes[0] = view_of(ball);
  studio.scene.meshes[0].look = 0.5f;
  const Image image = render_or_fail(studio.scene, small_settings());
  for (float value : image.pixels) ASSERT_TRUE(std::isfinite(value));
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) EXPECT_GE(image.at(x, y, 1), 0.0f);
}

TEST(Render, AnIndexBeyondThePositionsIsABug) {
  TestMesh ball = make_ball(8, 4);
  ball.triangles[3].v[1] = 1000;
  RenderScene scene = furnace();
  scene.meshes = {view_of(ball)};
  Renderer renderer = *Renderer::create();
  EXPECT_THROW((void)renderer.render(scene, small_settings()), BugError);
}

TEST(Render, DenormalsAreBackAfterwards) {
  const StudioScene studio;
  render_or_fail(studio.scene, small_settings(1));
  volatile float small = std::numeric_limits<float>::min();
  small = small / 4;
  EXPECT_GT(small, 0.0f);
}

TEST(Render, StatsCountRaysAndTime) {
  const StudioScene studio;
  Renderer renderer = *Renderer::create();
  ASSERT_TRUE(renderer.render(studio.scene, small_settings()));
  const Renderer::Stats once = renderer.stats();
  EXPECT_GT(once.rays, 48u * 36 * 16);
  EXPECT_GT(once.trace_seconds, 0);
  ASSERT_TRUE(renderer.render(studio.scene, small_settings()));
  EXPECT_EQ(renderer.stats().rays, once.rays);
}

}  // namespace
}  // namespace polymorph
