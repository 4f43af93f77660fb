#include "render/render.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "render/film.h"
#include "render/floating_point.h"
#include "render/integrator.h"

namespace polymorph {
namespace {

constexpr int kTile = 16;
constexpr float kFilterRadius = 1.35f;  // pixels; by eye between crisp and free of stair steps

/// What a sky depends on; it is made again only when this changes.
struct SkyKey {
  Frame rig;
  KeyLight key;
  Vec3 floor;
  float scale = 0;
  std::shared_ptr<const Image> image;
  SkyPart part = SkyPart::kAll;
};
bool same(const SkyKey& a, const SkyKey& b) {
  return a.rig.z == b.rig.z && a.key.frame.z == b.key.frame.z &&
         a.key.irradiance == b.key.irradiance && a.floor == b.floor && a.scale == b.scale &&
         a.image == b.image && a.part == b.part;
}

Sky make_sky(const SkyKey& key) {
  if (key.image) return make_image_sky(*key.image, key.scale, key.part);
  return make_studio_sky(key.rig, key.key, key.floor, key.scale, key.part);
}

float white_level(const KeyLight& key, const Sky& sky) {
  return kInvPi * (max_component(key.irradiance) + max_component(sky.upper_irradiance) +
                   sky.distribution.total);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The ray through (x, y), in pixels from the picture's upper left corner. Pixels are square.
Ray camera_ray(const Camera& camera, const ImageSettings& image, float x, float y) {
  const float scale = 2 * camera.tan_half_fov_y / static_cast<float>(image.height);
  const float across = (x - 0.5f * static_cast<float>(image.width)) * scale;
  const float upward = (0.5f * static_cast<float>(image.height) - y) * scale;
  return {camera.position, normalized(camera.forward + camera.right * across + camera.up * upward)};
}

/// All that the tiles share.
struct FrameJob {
  World world;
  Camera camera;
  RenderSettings settings;
  FrameSampler sampler;
  const PixelFilter* filter = nullptr;
};

Vec3 pixel_color(const FrameJob& job, int x, int y, Tally& tally) {
  const ImageSettings& image = job.settings.image;
  Vec3 sum;
  for (int s = 0; s < image.samples; ++s) {
    const PathSampler sampler(job.sampler, x, y, static_cast<std::uint32_t>(s));
    const Sample4 random = sampler.get(0);
    const float px = static_cast<float>(x) + 0.5f + filter_offset(*job.filter, random.a);
    const float py = static_cast<float>(y) + 0.5f + filter_offset(*job.filter, random.b);
    const Vec3 light = trace_path(job.world, camera_ray(job.camera, image, px, py), sampler, tally);
    // One bad normal or texel must not blacken a whole film's compositing.
    if (finite(light)) sum = sum + light;
  }
  // The control variate may leave a pixel a trace below black.
  return max(sum / static_cast<float>(image.samples), Vec3{});
}

FirstHit pixel_hit(const FrameJob& job, int x, int y, Tally& tally) {
  const Ray ray = camera_ray(job.camera, job.settings.image, static_cast<float>(x) + 0.5f,
                             static_cast<float>(y) + 0.5f);
  FirstHit hit = first_hit(job.world, ray, tally);
  if (hit.id > 0) hit.depth *= dot(ray.direction, job.camera.forward);
  return hit;
}

void render_tile(const FrameJob& job, int tile_x, int tile_y, Image& film, Tally& tally) {
  const FlushDenormals flush;
  const int right = std::min((tile_x + 1) * kTile, film.width);
  const int bottom = std::min((tile_y + 1) * kTile, film.height);
  for (int y = tile_y * kTile; y < bottom; ++y)
    for (int x = tile_x * kTile; x < right; ++x) {
      const Vec3 color = pixel_color(job, x, y, tally);
      float* pixel = &film.at(x, y, 0);
      pixel[0] = color.x;
      pixel[1] = color.y;
      pixel[2] = color.z;
      pixel[3] = 1;
      if (!job.settings.aovs) continue;
      const FirstHit hit = pixel_hit(job, x, y, tally);
      pixel += 4;
      for (const Aov& aov : kAovs) *pixel++ = aov.value(hit);
    }
}

}  // namespace

struct Renderer::State {
  RayDevice device;
  PixelFilter filter = make_pixel_filter(kFilterRadius);
  SkyKey sky_key;
  Sky sky;
  Stats stats;
};

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

Result<Renderer> Renderer::create(const std::string& isa) {
  auto state = std::make_unique<State>();
  PM_TRY(state->device, make_ray_device(isa));
  return Renderer(std::move(state));
}

Result<Image> Renderer::render(const RenderScene& scene, const RenderSettings& settings) {
  const ImageSettings& image = settings.image;
  PM_CHECK(image.width >= 1 && image.height >= 1 && image.samples >= 1);
  State& state = *state_;
  const auto start = std::chrono::steady_clock::now();
  PM_TRY(const TracedScene geometry, TracedScene::build(state.device, scene.meshes));

  SkyKey sky_key{make_rig(scene.camera),
                 make_key_light(scene.lights, scene.camera),
                 scene.ground.color * kFarTone,
                 scene.lights.sky_intensity,
                 scene.environment,
                 scene.ground.enabled ? SkyPart::kAboveHorizon : SkyPart::kAll};
  if (state.sky.width == 0 || !same(sky_key, state.sky_key)) {
    state.sky = make_sky(sky_key);
    state.sky_key = sky_key;
  }

  const Box& stage = scene.bounds.empty() ? geometry.bounds() : scene.bounds;
  FrameJob job;
  job.world = {&geometry,
               &state.sky,
               &sky_key.key,
               make_floor(scene.ground, stage),
               {},
               geometry.bounds().center(),
               geometry.bounds().empty() ? -std::numeric_limits<float>::infinity()
                                         : 0.5f * geometry.bounds().diagonal(),
               scene.look,
               white_level(sky_key.key, state.sky),
               image.max_depth};
  job.world.backdrop = {scene.environment ? &state.sky : nullptr,
                        sky_radiance(state.sky, {0, -1, 0}),
                        {scene.camera.right, scene.camera.up, scene.camera.forward},
                        1 / scene.camera.tan_half_fov_y};
  if (scene.environment) job.world.floor.far_tone = 1;
  job.camera = scene.camera;
  job.settings = settings;
  job.sampler = make_frame_sampler(image.seed, settings.frame, image.samples);
  job.filter = &state.filter;
  state.stats = {};
  state.stats.build_seconds = seconds_since(start);

  const auto trace_start = std::chrono::steady_clock::now();
  Image film = make_image(image.width, image.height, film_channels(settings.aovs));
  const int columns = (image.width + kTile - 1) / kTile, rows = (image.height + kTile - 1) / kTile;
  std::vector<Tally> tallies(static_cast<std::size_t>(columns) * rows);
  parallel_for(columns * rows, [&](std::int64_t i) {
    const int tile = static_cast<int>(i);
    render_tile(job, tile % columns, tile / columns, film, tallies[i]);
  });
  PM_TRY_STATUS(take_device_error(state.device));
  for (const Tally& tally : tallies) state.stats.rays += tally.rays;
  state.stats.trace_seconds = seconds_since(trace_start);
  return film;
}

Renderer::Stats Renderer::stats() const { return state_->stats; }
std::string Renderer::isa() const { return state_->device.isa; }

}  // namespace polymorph
