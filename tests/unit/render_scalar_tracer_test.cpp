// Other processors give the same bits as eight lanes of the CPU: a GPU, where there is one, and
// what it does on the CPU. One path after the other, among triangles that the renderer's own
// hierarchy proposes, are those of eight at a time among the triangles that Embree proposes.
#include <cstdlib>
#include <cstring>

#include "base/random.h"
#include "kernels/floating_point.h"
#include "render/device/bvh.h"
#include "render/device/device_frame.h"
#include "render/device/device_tracer.h"
#include "render/math/vector_math.h"
#include "testing/render.h"
#include "testing/texture.h"

namespace polymorph {
namespace {

using namespace testing;

/// The scalar tracer, and the first GPU's where there is one.
std::vector<std::unique_ptr<DeviceTracer>> make_tracers() {
  std::vector<std::unique_ptr<DeviceTracer>> tracers;
  tracers.push_back(make_scalar_tracer());
  std::string error;
  if (auto cuda = make_cuda_tracer(0, error))
    tracers.push_back(std::move(cuda));
  else
    EXPECT_EQ(std::getenv("POLYMORPH_REQUIRE_CUDA"), nullptr) << error;
  return tracers;
}

void expect_same_bits(const RenderScene& scene, const RenderSettings& settings) {
  Renderer lanes = *Renderer::create();
  const Image expected = *lanes.render(scene, settings);
  EXPECT_GT(mean_green(expected), 0.01);
  for (auto& tracer : make_tracers()) {
    Renderer renderer = *Renderer::create();
    renderer.set_device_tracer(std::move(tracer));
    const Image image = *renderer.render(scene, settings);
    EXPECT_FALSE(renderer.traced_on_cpu());
    EXPECT_EQ(renderer.stats().paths, lanes.stats().paths);
    ASSERT_EQ(expected.pixels.size(), image.pixels.size());
    std::size_t differing = 0;
    for (std::size_t i = 0; i < expected.pixels.size(); ++i)
      differing += float_bits(expected.pixels[i]) != float_bits(image.pixels[i]) ? 1 : 0;
    EXPECT_EQ(differing, 0u) << "of " << expected.pixels.size();
  }
}

/// An image sky with a texel as bright as a sun.
std::shared_ptr<const Image> make_bright_sky() {
  Image sky = make_image(64, 32, {"R", "G", "B"});
  for (std::size_t i = 0; i < sky.pixels.size(); ++i)
    sky.pixels[i] = i / 3 == 64 * 8 + 20 ? 900.0f : 0.2f + 0.01f * static_cast<float>(i % 7);
  return std::make_shared<const Image>(std::move(sky));
}

TEST(ScalarTracer, StudioHasTheSameBits) {
  BallOnFloor studio;
  expect_same_bits(studio.scene, small_settings(16));
  RenderSettings settings = small_settings(40);  // blocks of 16, 16 and 8
  settings.frame = 3;
  settings.image.aovs = "all";
  expect_same_bits(studio.scene, settings);
  settings.image.steady = false;
  settings.image.max_depth = 1;
  expect_same_bits(studio.scene, settings);
}

TEST(ScalarTracer, LightWithoutPathsHasTheSameBits) {
  BallOnFloor studio;
  studio.scene.lights.lamps = {make_lamp(LampKind::kPanel, {1, 2, 1}),
                               make_lamp(LampKind::kLamp, {-1, 1, 1})};
  RenderSettings settings = small_settings(3);
  settings.image.max_depth = 0;
  for (const LookKind look : {LookKind::kOwn, LookKind::kMetal, LookKind::kGlass}) {
    studio.scene.look.kind = look;
    studio.scene.meshes[0].look = look == LookKind::kOwn ? 0.0f : 0.7f;
    expect_same_bits(studio.scene, settings);
  }
  studio.scene.ground.shadow_only = true;
  expect_same_bits(studio.scene, settings);
  studio.scene.ground.shadow_only = false;
  studio.scene.look.kind = LookKind::kMetal;
  studio.scene.environment = make_bright_sky();
  expect_same_bits(studio.scene, settings);
}

TEST(ScalarTracer, MirrorsAndColorsOfVerticesHaveTheSameBits) {
  BallOnFloor studio;
  studio.scene.look.kind = LookKind::kMetal;
  studio.scene.meshes[0].look = 1;
  expect_same_bits(studio.scene, small_settings());
  studio.scene.meshes[0].look = 0.4f;
  std::vector<Vec3> colors;
  for (const Vec3& p : studio.ball.positions) colors.push_back(p * 0.5f + Vec3{0.5f, 0.5f, 0.5f});
  studio.scene.meshes[0].vertex_colors = colors;
  studio.scene.meshes[0].vertex_color_opacity = 0.7f;
  expect_same_bits(studio.scene, small_settings());
}

TEST(ScalarTracer, GlassHasTheSameBits) {
  BallOnFloor studio;
  studio.scene.look.kind = LookKind::kGlass;
  for (const float roughness : {0.0f, 0.4f}) {
    studio.scene.look.roughness = roughness;
    studio.scene.meshes[0].look = 1;
    expect_same_bits(studio.scene, small_settings());
  }
}

TEST(ScalarTracer, LampsSunsAndImageSkiesHaveTheSameBits) {
  BallOnFloor studio;
  studio.scene.lights.lamps = {make_lamp(LampKind::kPanel, {1, 2, 1}),
                               make_lamp(LampKind::kSun, {}),
                               make_lamp(LampKind::kLamp, {-1, 1, 1})};
  expect_same_bits(studio.scene, small_settings());
  studio.scene.environment = make_bright_sky();
  expect_same_bits(studio.scene, small_settings());
  studio.scene.environment = nullptr;
  studio.scene.lights.sky = SkyKind::kDay;
  studio.scene.ground.shadow_only = true;
  expect_same_bits(studio.scene, small_settings());
}

TEST(ScalarTracer, LensTexturesAndMotionHaveTheSameBits) {
  BallOnFloor studio;
  const TestMesh square = make_checkered_square();
  studio.scene.meshes.push_back(view_of(square, 3));
  studio.scene.camera.lens_radius = 0.1f;
  studio.scene.camera.focus = 4;
  expect_same_bits(studio.scene, small_settings());
  const std::vector<Vec3> displacement(studio.ball.positions.size(), Vec3{0.3f, 0.1f, 0});
  studio.scene.meshes[0].displacement = displacement;
  studio.scene.camera.shutter = 0.5f;
  CameraMotion motion{studio.scene.camera, studio.scene.camera, studio.scene.camera};
  motion.closing.position.x += 0.2f;
  studio.scene.camera_motion = motion;
  expect_same_bits(studio.scene, small_settings());
}

TEST(ScalarTracer, TexturesOfCodesAndOfFloatsHaveTheSameBits) {
  BallOnFloor studio;
  TestMesh square = make_checkered_square();
  // Codes of one, three and four channels: their pictures are those of floats, on the CPU and on
  // the device.
  Image colors = make_image(23, 9, {"R", "G", "B", "A"});
  for (std::size_t i = 0; i < colors.pixels.size(); ++i)
    colors.pixels[i] = static_cast<float>(i * 7919 % 256) / 256;
  Image opaque = make_image(23, 9, {"R", "G", "B"});
  for (std::size_t i = 0; i < opaque.pixels.size(); ++i)
    opaque.pixels[i] = static_cast<float>(i * 6007 % 256) / 256;
  for (const Image& image : {colors, opaque}) {
    const std::shared_ptr<const Texture> coded = coded_texture(image);
    std::vector<std::string> digests;
    for (const auto& texture : {coded, float_texture(texture_image(*coded))}) {
      square.textures = {texture};
      studio.scene.meshes.resize(1);
      studio.scene.meshes.push_back(view_of(square, 3));
      expect_same_bits(studio.scene, small_settings());
      const auto picture = Renderer::create()->render(studio.scene, small_settings());
      ASSERT_TRUE(picture) << picture.error().message;
      digests.push_back(pixel_digest(*picture));
    }
    EXPECT_EQ(digests[0], digests[1]);
  }
}

TEST(ScalarTracer, SmoothedCentersHaveTheSameBits) {
  BallOnFloor studio;
  RenderSettings settings = small_settings(/*samples=*/1);
  settings.image.width = 45;  // the last tile is narrower than a tile, and not whole packs
  settings.image.smooth = true;
  // The lanes take the AOVs from what the paths have looked up, the other tracer looks them up.
  settings.image.aovs = "all";
  const TestMesh square = make_checkered_square();
  studio.scene.meshes.push_back(view_of(square, 3));
  studio.scene.meshes[1].look = 0.3f;
  for (const LookKind kind : {LookKind::kMetal, LookKind::kGlass}) {
    studio.scene.look.kind = kind;
    for (const int depth : {1, 4}) {
      settings.image.max_depth = depth;
      expect_same_bits(studio.scene, settings);
    }
  }
}

TEST(ScalarTracer, EmptyScenesAndSingleTrianglesAreTraced) {
  expect_same_bits(furnace(), small_settings());
  RenderScene scene = furnace();
  TestMesh square = make_square({}, {1, 0, 0}, {0, 1, 0}, 0.7f);
  square.triangles.resize(1);
  square.uvs.resize(3);
  scene.meshes = {view_of(square)};
  expect_same_bits(scene, small_settings());
}

/// Traces frames of other samples from other sides until their rays are as many as POLYMORPH_RAYS
/// asks for: a hit that differs is light that differs.
TEST(ScalarTracer, ManyRaysHaveTheSameBitsOnAGpu) {
  std::string error;
  if (!make_cuda_tracer(0, error)) {
    EXPECT_EQ(std::getenv("POLYMORPH_REQUIRE_CUDA"), nullptr) << error;
    GTEST_SKIP() << error;
  }
  const char* asked = std::getenv("POLYMORPH_RAYS");
  const double rays = asked ? std::atof(asked) : 1e7;
  BallOnFloor studio;
  const TestMesh small = make_ball(33, 17, 0.4f);
  studio.scene.meshes.push_back(view_of(small, 3));
  studio.scene.meshes[0].look = 1;
  studio.scene.look.kind = LookKind::kMetal;
  RenderSettings settings = small_settings(64);
  settings.image.width = 320;
  settings.image.height = 240;
  settings.image.aovs = "all";
  Renderer lanes = *Renderer::create(), device = *Renderer::create();
  device.set_device_tracer(make_cuda_tracer(0, error));
  double traced = 0;
  for (settings.frame = 1; traced < rays; ++settings.frame) {
    CameraSettings camera;
    camera.azimuth = 37.0f * static_cast<float>(settings.frame);
    studio.scene.camera = make_camera(camera, studio.scene.bounds, 320, 240);
    const Image expected = *lanes.render(studio.scene, settings);
    const Image image = *device.render(studio.scene, settings);
    ASSERT_FALSE(device.traced_on_cpu());
    ASSERT_TRUE(std::memcmp(expected.pixels.data(), image.pixels.data(),
                            expected.pixels.size() * sizeof(float)) == 0)
        << "frame " << settings.frame;
    traced += static_cast<double>(device.stats().rays);
  }
  RecordProperty("rays", std::to_string(traced));
}

TEST(ScalarTracer, AdaptiveSamplesHaveTheSameBits) {
  BallOnFloor studio;
  for (const int samples : {8, 16, 63, 64, 200}) {
    RenderSettings settings = small_settings(samples);
    settings.image.noise = 0.1f;
    settings.image.aovs = "all";
    expect_same_bits(studio.scene, settings);
    settings.image.noise = 1e-6f;  // nothing converges
    expect_same_bits(studio.scene, settings);
  }
  RenderSettings settings = small_settings(200);
  settings.image.noise = 0.1f;
  Renderer renderer = *Renderer::create();
  renderer.set_device_tracer(make_scalar_tracer());
  ASSERT_TRUE(renderer.render(studio.scene, settings));
  const auto pixels = static_cast<std::uint64_t>(settings.image.width * settings.image.height);
  EXPECT_GT(renderer.stats().paths, 16 * pixels);
  EXPECT_LT(renderer.stats().paths, 150 * pixels);
}

/// Light comes from the tracer, guides of the denoiser and mattes from the CPU's own rays.
TEST(ScalarTracer, GuidesAndMattesHaveTheSameBits) {
  BallOnFloor studio;
  RenderSettings settings = small_settings(20);
  settings.image.aovs = "crypto_object,depth";
  expect_same_bits(studio.scene, settings);
  settings.image.noise = 0.1f;
  settings.image.samples = 100;
  expect_same_bits(studio.scene, settings);
  // Where Open Image Denoise is there (POLYMORPH_OIDN).
  settings.image.denoise = static_cast<bool>(check_denoiser());
  expect_same_bits(studio.scene, settings);
}

/// Away from edges rays hit the same without the exact decision.
TEST(ScalarTracer, BareHitsAreThoseOfTheExactDecisionButForEdges) {
  BallOnFloor studio;
  const RayDevice device = *make_ray_device("");
  const TracedScene scene = *TracedScene::build(device, studio.scene.meshes, 0, 10);
  const Sky sky = make_image_sky(*constant_sky(1), 1, SkyDomain::kAll);
  const PixelFilter filter = make_pixel_filter(1);
  FrameJob job;
  job.world.geometry = &scene;
  job.world.sky = sky;
  job.camera.filter = &filter;
  std::vector<Ray> rays;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const auto number = [&](std::uint64_t k) { return 2 * random_float(6, i, k) - 1; };
    const Vec3 from = normalized(Vec3{number(0), number(1), number(2)}) * 4.0f;
    rays.push_back({from, normalized(Vec3{number(3), number(4), number(5)} - from)});
  }
  for (auto& tracer : make_tracers()) {
    std::vector<MeshHit> exact(rays.size()), bare(rays.size());
    double seconds = -1;
    ASSERT_EQ(tracer->find_hits(job, rays, false, exact, seconds), "");
    EXPECT_GE(seconds, 0);
    ASSERT_EQ(tracer->find_hits(job, rays, true, bare, seconds), "");
    int found = 0, differing = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const FlushDenormals flush;
      const MeshHit expected = scene.closest(rays[i]);
      ASSERT_EQ(exact[i].triangle, expected.triangle);
      ASSERT_EQ(exact[i].distance, expected.distance);
      found += exact[i].mesh != kNoMesh ? 1 : 0;
      differing += bare[i].triangle != exact[i].triangle ? 1 : 0;
      if (bare[i].triangle == exact[i].triangle && exact[i].mesh != kNoMesh) {
        EXPECT_NEAR(bare[i].distance, exact[i].distance, 1e-3f);
      }
    }
    EXPECT_GT(found, 500);
    EXPECT_LT(differing, 10);
  }
}

/// A square of two materials, whose halves have charts of their own, traced as a finer square that
/// takes them.
struct BorderedSquare {
  Model model;
  TestMesh fine = make_square({0.3f, 0.2f, 0.9f}, {1, 0, 0}, {0, 1, 0}, 0.5f);
  std::unique_ptr<ClosestPointQuery> closest;
  TransferredMaterials materials;

  /// `extra`: triangles far away, which are part of the model too.
  explicit BorderedSquare(const std::vector<Triangle>& extra = {},
                          const std::vector<Vec3>& extra_points = {}) {
    const TestMesh square = make_checkered_square();
    model.points = square.positions;
    model.triangles = square.triangles;
    model.points.insert(model.points.end(), extra_points.begin(), extra_points.end());
    model.triangles.insert(model.triangles.end(), extra.begin(), extra.end());
    model.corner_uvs = square.uvs;
    for (std::size_t c = 3; c < 6; ++c) model.corner_uvs[c] = model.corner_uvs[c] * 0.6f;
    model.corner_uvs.resize(3 * model.triangles.size());
    model.triangle_materials.resize(model.triangles.size());
    model.triangle_materials[1] = 1;
    model.materials = {square.materials[0], square.materials[0]};
    model.materials[1].color = {0.2f, 0.5f, 0.9f};
    model.textures = square.textures;
    closest = std::make_unique<ClosestPointQuery>(model);
    make_grid();
    materials = MaterialTransfer(model, *closest, find_texture_charts(model), {fine.positions},
                                 fine.triangles)
                    .all();
  }
  RenderMesh view() const {
    RenderMesh mesh = view_of(fine, 3);
    mesh.corner_uvs = materials.corner_uvs;
    mesh.triangle_materials = materials.triangle_materials;
    mesh.materials = model.materials;
    mesh.textures = model.textures;
    mesh.borders = {&model, closest.get(), materials.borders, materials.border_index};
    return mesh;
  }

 private:
  /// Cuts the square into a grid whose lines do not follow its diagonal.
  void make_grid() {
    constexpr std::uint32_t kCells = 7;
    const std::vector<Vec3> corners = fine.positions;
    fine = {};
    for (std::uint32_t i = 0; i <= kCells; ++i)
      for (std::uint32_t k = 0; k <= kCells; ++k) {
        const float s = static_cast<float>(i) / kCells, t = static_cast<float>(k) / kCells;
        fine.positions.push_back(corners[0] + (corners[1] - corners[0]) * s +
                                 (corners[3] - corners[0]) * t);
        if (i == kCells || k == kCells) continue;
        const std::uint32_t v = i * (kCells + 1) + k;
        fine.triangles.push_back({{v, v + kCells + 1, v + 1}});
        fine.triangles.push_back({{v + 1, v + kCells + 1, v + kCells + 2}});
      }
  }
};

TEST(ScalarTracer, BordersOfMaterialsHaveTheSameBits) {
  BallOnFloor studio;
  const BorderedSquare square;
  ASSERT_GT(square.materials.borders.size(), 5u);
  studio.scene.meshes.push_back(square.view());
  expect_same_bits(studio.scene, small_settings(32));
  MixedLayer over;
  static_cast<MaterialLayer&>(over) = square.view();
  over.opacity = 0.4f;
  studio.scene.meshes[1].upper_layers.push_back(over);
  RenderSettings settings = small_settings(32);
  settings.image.aovs = "all";
  expect_same_bits(studio.scene, settings);
}

/// A GPU gets all that the CPU looks up at its hits.
TEST(ScalarTracer, MaterialsLookedUpAtHitsHaveTheSameBits) {
  BallOnFloor studio, given;
  const BorderedSquare square;
  const std::vector<std::uint32_t> charts = find_texture_charts(square.model);
  const MaterialTransfer transfer(square.model, *square.closest, charts, {square.fine.positions},
                                  square.fine.triangles);
  RenderMesh mesh = square.view();
  MixedLayer over;
  static_cast<MaterialLayer&>(over) = mesh;
  over.opacity = 0.4f;
  mesh.upper_layers = {over};
  given.scene.meshes.push_back(mesh);
  for (MaterialLayer* layer :
       {static_cast<MaterialLayer*>(&mesh), static_cast<MaterialLayer*>(&mesh.upper_layers[0])}) {
    layer->corner_uvs = {};
    layer->triangle_materials = {};
    layer->borders.triangles = {};
    layer->borders.border_index = {};
    layer->transfer = &transfer;
  }
  studio.scene.meshes.push_back(mesh);
  // With many samples per triangle all materials are looked up before the first ray.
  for (const int samples : {4, 256}) {
    RenderSettings settings = small_settings(samples);
    settings.image.aovs = "all";
    expect_same_bits(studio.scene, settings);
    EXPECT_EQ(pixel_digest(render_or_fail(studio.scene, settings)),
              pixel_digest(render_or_fail(given.scene, settings)));
  }
}

/// The closest of thousands of long triangles depends on the way to it.
TEST(ScalarTracer, BordersOfThousandsOfLongTrianglesAreLeftToTheCpu) {
  std::vector<Vec3> points;
  std::vector<Triangle> fan;
  for (std::uint32_t i = 0; i < 5000; ++i) {
    const float turn = static_cast<float>(i) * 0.7f;
    const std::uint32_t v = 4 + 3 * i;
    points.insert(points.end(), {{9, 9, 9},
                                 {9 + 5 * std::cos(turn), 9 + 5 * std::sin(turn), 9},
                                 {9 + 5 * std::cos(turn), 9 + 5 * std::sin(turn), 9.01f}});
    fan.push_back({{v, v + 1, v + 2}});
  }
  const BorderedSquare square(fan, points);
  ASSERT_TRUE(square.closest->view().is_split);
  BallOnFloor studio;
  studio.scene.meshes.push_back(square.view());
  const RenderSettings settings = small_settings();
  Renderer renderer = *Renderer::create();
  renderer.set_device_tracer(make_scalar_tracer());
  EXPECT_EQ(renderer.render(studio.scene, settings)->pixels,
            render_or_fail(studio.scene, settings).pixels);
  EXPECT_TRUE(renderer.traced_on_cpu());
}

TEST(ScalarTracer, SumsThatFillTheMemoryAreLeftToTheCpu) {
  BallOnFloor studio;
  const RayDevice device = *make_ray_device("");
  const TracedScene scene = *TracedScene::build(device, studio.scene.meshes, 0, 10);
  FrameJob job;
  job.world.geometry = &scene;
  job.image.width = 3840;
  job.image.height = 2160;
  job.samples = {0, 512, 512};
  EXPECT_EQ(find_device_obstacle(job), "");
  job.samples = {16, 4096, 4096};  // eight nodes a pixel
  EXPECT_NE(find_device_obstacle(job).find("pictures of this size"), std::string::npos);
}

TEST(ScalarTracer, MemoryIsLimitedToWhatIsAllowed) {
  BallOnFloor studio;
  const TracedScene scene(studio.scene.meshes, 0, 10, {});
  FrameJob job;
  job.world.geometry = &scene;
  job.image.width = 1920;
  job.image.height = 1080;
  DeviceFrame frame;
  frame.end_sample = 64;
  frame.node_count = 1;
  frame.finds_centers = true;
  const std::size_t film =
      std::size_t{1920} * 1080 * (sizeof(PixelSum) + sizeof(MeshHit) + sizeof(bool));
  const std::size_t row = std::size_t{1920} * 64 * sizeof(PathLight);
  const std::size_t frame_bytes = 5'000'000;
  const std::size_t fixed =
      frame_bytes + studio.scene.meshes[0].triangles.size() * kHierarchyBytes + film;
  const auto choose = [&](std::size_t limit) {
    return size_buffers(job, frame, frame_bytes, limit);
  };
  EXPECT_EQ(choose(0).rows, 34u);  // 4 million paths
  EXPECT_EQ(choose(std::size_t{1} << 40).rows, 34u);
  EXPECT_EQ(choose(fixed + 3 * row).rows, 3u);
  EXPECT_EQ(choose(fixed + row).rows, 1u);
  const std::string error = choose(fixed + row - 1).error;
  EXPECT_NE(error.find("above --max-memory"), std::string::npos) << error;

  // The CPU traces a frame that is refused; a frame of a few rows a launch has the same bits.
  const RenderSettings settings = small_settings(16);
  const Image expected = render_or_fail(studio.scene, settings);
  for (const std::size_t limit : {std::size_t{1000}, std::size_t{3'000'000}})
    for (auto& tracer : make_tracers()) {
      tracer->limit_memory(limit);
      Renderer renderer = *Renderer::create();
      renderer.set_device_tracer(std::move(tracer));
      EXPECT_EQ(renderer.render(studio.scene, settings)->pixels, expected.pixels);
      EXPECT_EQ(renderer.traced_on_cpu(), limit == 1000);
    }
}

/// Points of the interior, of edges and of corners, seen from all sides.
TEST(ScalarTracer, ClosestHitsAreThoseOfEmbree) {
  const RayDevice device = *make_ray_device("");
  TestMesh ball = make_ball(40, 20), other = make_ball(33, 17, 0.8f);
  for (Vec3& p : other.positions) p = p + Vec3{0.4f, 0.1f, 0.2f};
  const std::vector<RenderMesh> meshes = {view_of(ball), view_of(other)};
  const TracedScene scene = *TracedScene::build(device, meshes, 0, 10);
  FrameJob job;
  job.world.geometry = &scene;
  Sky sky = make_image_sky(*constant_sky(1), 1, SkyDomain::kAll);
  job.world.sky = sky;
  const PixelFilter filter = make_pixel_filter(1);
  job.camera.filter = &filter;
  DeviceFrame frame;
  std::vector<std::byte> memory(pack_frame(job, nullptr, nullptr, frame));
  pack_frame(job, memory.data(), memory.data(), frame);
  const Bvh bvh = build_bvh(frame.scene);
  frame.scene.nodes = bvh.nodes;
  frame.scene.triangles = bvh.triangles;
  frame.scene.root = bvh.root;
  const FlushDenormals flush;
  int hits = 0;
  for (std::uint64_t i = 0; i < 100000; ++i) {
    const auto number = [&](std::uint64_t k) { return 2 * random_float(5, i, k) - 1; };
    const Vec3 from =
        normalized(Vec3{number(0), number(1), number(2)}) * (i % 2 == 0 ? 4.0f : 0.3f);
    const Triangle& t = ball.triangles[i % ball.triangles.size()];
    const float u = i % 3 == 0 ? 0.0f : 0.5f + 0.5f * number(3);
    Vec3 to = ball.positions[t.v[0]] * u + ball.positions[t.v[1]] * (1 - u);
    if (i % 4 == 0) to = to * 0.999f + ball.positions[t.v[2]] * 0.001f;
    const Ray ray{from, normalized(to - from)};
    const MeshHit expected = scene.closest(ray), hit = frame.scene.closest(ray);
    hits += expected.mesh != kNoMesh ? 1 : 0;
    ASSERT_EQ(hit.mesh, expected.mesh) << i;
    ASSERT_EQ(hit.triangle, expected.triangle) << i;
    ASSERT_EQ(hit.distance, expected.distance) << i;
    ASSERT_EQ(hit.u, expected.u) << i;
    ASSERT_EQ(hit.v, expected.v) << i;
    ASSERT_EQ(frame.scene.is_occluded(ray), expected.mesh != kNoMesh) << i;
  }
  EXPECT_GT(hits, 50000);
}

}  // namespace
}  // namespace polymorph
