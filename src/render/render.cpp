#include "render/render.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "base/log.h"
#include "base/parallel.h"
#include "base/stopwatch.h"
#include "render/device/device_frame.h"
#include "render/device/device_tracer.h"
#include "render/film/denoise.h"
#include "render/film/part.h"
#include "render/film/smooth.h"
#include "render/lights/day_sky.h"
#include "render/tile.h"

namespace polymorph {
namespace {

// Radius of the pixel filter, in pixels. It was chosen by eye, as a compromise between sharpness
// and aliasing.
constexpr float kFilterRadius = 1.35f;

/// All inputs of a sky, which is recomputed only if one of them changes.
struct SkyKey {
  Frame rig;  ///< make_rig(); its z determines x and y
  DistantLight key_light;
  Vec3 floor;
  float scale = 0;
  std::shared_ptr<const Image> image;
  SkyDomain domain = SkyDomain::kAll;
  SkyKind kind = SkyKind::kStudio;
  float turbidity = 3;
};
bool is_equal(const SkyKey& a, const SkyKey& b) {
  return a.rig.z == b.rig.z && a.key_light.frame.z == b.key_light.frame.z &&
         a.key_light.irradiance == b.key_light.irradiance && a.floor == b.floor &&
         a.scale == b.scale && a.image == b.image && a.domain == b.domain && a.kind == b.kind &&
         a.turbidity == b.turbidity;
}

Sky make_sky(const SkyKey& key) {
  if (key.image) return make_image_sky(*key.image, key.scale, key.domain);
  if (key.kind == SkyKind::kDay)
    return make_day_sky(key.key_light, key.floor, key.turbidity, key.scale, key.domain);
  return make_studio_sky(key.rig, key.key_light, key.floor, key.scale, key.domain);
}

/// Radiance of a white surface that receives the light of the sky and of all suns and lamps.
float white_level(const std::vector<DistantLight>& suns, const std::vector<Lamp>& lamps,
                  const Sky& sky) {
  float sum = max_component(sky.upper_irradiance) + sky.distribution.total;
  for (const DistantLight& sun : suns) sum += max_component(sun.irradiance);
  for (const Lamp& lamp : lamps) sum += max_component(lamp.irradiance);
  return kInvPi * sum;
}

bool has_glass(const RenderScene& scene) {
  const auto is_glass = [](const MaterialLayer& layer) {
    return std::any_of(layer.materials.begin(), layer.materials.end(),
                       [](const Material& material) { return material.transmission > 0; });
  };
  return std::any_of(scene.meshes.begin(), scene.meshes.end(), [&](const RenderMesh& mesh) {
    return any_layer(mesh, is_glass) ||
           (scene.look.kind == LookKind::kGlass && (mesh.look > 0 || mesh.materials.empty()));
  });
}

/// Computes an upper bound of the distance between the centre of the meshes and the start of any
/// ray, which may be the camera or a point of the floor.
float max_start_distance(const RenderScene& scene) {
  Box box = scene.bounds;
  for (const RenderMesh& mesh : scene.meshes)
    for (const Vec3& p : mesh.positions) box = extend(box, p);
  if (box.empty()) return 0;
  const float floor = scene.ground.enabled ? make_floor(scene.ground, box).fade_end : 0;
  return std::max(length(scene.camera.position - box.center()), floor) + box.diagonal();
}

/// Tests whether smooth_noise() applies. It does not if lens or shutter blur the picture, because
/// the AOVs that guide the filter are sharp.
bool is_smoothed(const ImageSettings& image, const Camera& camera) {
  return image.smooth && !image.denoise && !(camera.lens_radius > 0) && !(camera.shutter > 0);
}

/// Lists the AOVs that a film needs for smooth_noise() if the image has the AOVs `layers`.
std::string layers_to_smooth(const std::string& layers) {
  if (layers == "all") return layers;
  return layers == "none" ? kSmoothLayers : fmt::format("{},{}", layers, kSmoothLayers);
}

/// Lists the channels of the film that is traced: colours (or the sums of a part), AOVs,
/// mattes and guides.
std::vector<std::string> list_traced_channels(const FrameJob& job,
                                              const std::optional<SampleRange>& part) {
  std::vector<std::string> channels{"R", "G", "B", "A"};
  if (part) channels = list_node_channels(*part);
  for (const Aov* aov : job.aovs) channels.emplace_back(aov->channel);
  const auto append = [&](const std::vector<std::string>& more) {
    channels.insert(channels.end(), more.begin(), more.end());
  };
  if (!part) append(job.mattes->channels());
  if (job.image.denoise) append(list_guide_channels());
  return channels;
}

/// Tests whether MaterialLayer::transfer is asked where rays meet the layer's mesh.
bool is_looked_up(const MaterialLayer& layer) {
  return layer.transfer && !layer.transfer->is_uniform();
}

/// Tests whether a picture takes so many samples per triangle with materials to be looked up that
/// looking up all of them in order, before the first ray, takes less time than one by one when a
/// ray first asks: 6 % less of frames of 640 x 480 with 16 samples. Previews need too few of them.
bool needs_most_materials(const RenderScene& scene, const ImageSettings& image, int samples) {
  constexpr double kSamplesPerTriangle = 16;
  double triangles = 0;
  for (const RenderMesh& mesh : scene.meshes)
    if (any_layer(mesh, is_looked_up)) triangles += static_cast<double>(mesh.triangles.size());
  return triangles > 0 && static_cast<double>(image.width) * image.height * samples >=
                              kSamplesPerTriangle * triangles;
}

/// Meshes with all that MaterialLayer::transfer would look up at their hits.
class TransferredMeshes {
 public:
  /// `for_device`: a GPU, which cannot ask MaterialLayer::transfer, traces them. Otherwise layers
  /// of one material keep it.
  TransferredMeshes(const std::vector<RenderMesh>& meshes, bool for_device)
      : meshes_(meshes), for_device_(for_device) {
    for (RenderMesh& mesh : meshes_) {
      transfer_all(mesh);
      for (MixedLayer& layer : mesh.upper_layers) transfer_all(layer);
    }
  }
  const std::vector<RenderMesh>& meshes() const { return meshes_; }

 private:
  void transfer_all(MaterialLayer& layer) {
    if (!layer.transfer || !(for_device_ || is_looked_up(layer))) return;
    const TransferredMaterials& all = materials_.emplace_back(layer.transfer->all());
    layer.corner_uvs = all.corner_uvs;
    layer.triangle_materials = all.triangle_materials;
    layer.borders.triangles = all.borders;
    layer.borders.border_index = all.border_index;
    layer.transfer = nullptr;
  }

  std::vector<RenderMesh> meshes_;
  bool for_device_;
  std::deque<TransferredMaterials> materials_;  ///< the layers borrow them
};

/// Allocates the sums of a part's mattes.
MatteSums make_matte_sums(const SampleRange& part, const ImageSettings& image,
                          const Mattes& mattes) {
  MatteSums sums{mattes.layers(), /*sums=*/{}};
  sums.sums.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) *
                   mattes.layer_count() * list_nodes(part).size());
  return sums;
}

/// Adds the header attributes that merge_parts() needs to make a picture with these channels.
void add_part_attributes(const SampleRange& part, const std::vector<std::string>& channels,
                         bool smooth, Image& film) {
  film.attributes.push_back({kPartSamplesAttribute, format_sample_range(part)});
  film.attributes.push_back({kPartChannelsAttribute, fmt::format("{}", fmt::join(channels, ","))});
  film.attributes.push_back({kPartSmoothAttribute, smooth ? 1 : 0});
}

}  // namespace

struct Renderer::State {
  RayDevice device;
  PixelFilter filter = make_pixel_filter(kFilterRadius);
  PixelFilter center_filter = make_pixel_filter(/*radius=*/0);  ///< all rays through pixel centres
  SkyKey sky_key;
  Sky sky;
  std::optional<Denoiser> denoiser;  ///< opened for the first image that uses it
  std::unique_ptr<DeviceTracer> device_tracer;
  std::string device_obstacle;  ///< why the device did not trace the last frame; empty if it did
  Stats stats;

  /// Traces the frame's samples with the device tracer, if it can. Returns whether it did.
  bool trace_on_device(const FrameJob& job, DeviceFilm& film, RayStats& device_stats);
};

bool Renderer::State::trace_on_device(const FrameJob& job, DeviceFilm& film,
                                      RayStats& device_stats) {
  if (!device_tracer) return false;
  std::string reason = find_device_obstacle(job);
  RayStats traced_stats;  // counts only if the GPU traces the whole frame
  if (reason.empty()) reason = device_tracer->trace(job, film, traced_stats);
  if (reason.empty())
    device_stats = traced_stats;
  else if (reason != device_obstacle)
    log_info("the CPU traces frames that the GPU cannot: {}", reason);
  device_obstacle = reason;
  return reason.empty();
}

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
  const std::optional<SampleRange>& part = settings.part;
  PM_CHECK(!part || (part->total == image.samples && !(image.noise > 0) && !image.denoise));
  State& state = *state_;
  if (image.denoise && !state.denoiser) {
    PM_TRY(Denoiser denoiser, Denoiser::open());
    state.denoiser = std::move(denoiser);
  }
  const Stopwatch build_watch;
  std::optional<TransferredMeshes> transferred;
  if (const bool for_device = state.device_tracer != nullptr;
      for_device || needs_most_materials(scene, image, part ? part->count() : image.samples))
    transferred.emplace(scene.meshes, for_device);
  TracedScene geometry(transferred ? transferred->meshes() : scene.meshes, scene.camera.shutter,
                       max_start_distance(scene), scene.bounds);

  // Lights and sky.
  const Camera& rig = scene.rig ? *scene.rig : scene.camera;
  const Box& sequence_bounds = scene.bounds.empty() ? geometry.bounds() : scene.bounds;
  std::vector<DistantLight> suns{make_key_light(scene.lights, rig)};
  std::vector<Lamp> lamps;
  for (const LampSettings& lamp : scene.lights.lamps)
    if (lamp.kind == LampKind::kSun)
      suns.push_back(make_sun(lamp, rig));
    else
      lamps.push_back(make_lamp(lamp, sequence_bounds.empty() ? Vec3{} : sequence_bounds.center()));
  const bool shows_sky = scene.environment || scene.lights.sky == SkyKind::kDay;
  // The studio's sky shows the distant floor, which is darker.
  SkyKey sky_key{make_rig(rig),
                 suns.front(),
                 shows_sky ? scene.ground.color : scene.ground.color * kFarTone,
                 scene.lights.sky_intensity,
                 scene.environment,
                 scene.ground.enabled ? SkyDomain::kAboveHorizon : SkyDomain::kAll,
                 scene.lights.sky,
                 scene.lights.turbidity};
  if (state.sky.width == 0 || !is_equal(sky_key, state.sky_key)) {
    state.sky = make_sky(sky_key);
    state.sky_key = sky_key;
  }

  // The job that all tiles of the film share.
  FrameJob job;
  World& world = job.world;
  world.geometry = &geometry;
  world.bounds = geometry.bounds();
  world.upright_radius = geometry.upright_radius();
  world.epsilon = geometry.epsilon();
  world.sky = state.sky;
  world.suns = suns;
  world.lamps = lamps;
  world.floor = make_floor(scene.ground, sequence_bounds);
  if (shows_sky) world.floor.far_tone = 1;
  // The paper has the colour of the lit floor, which the studio's sky shows straight down.
  world.backdrop = {shows_sky,
                    sky_radiance(state.sky, Vec3{0, -1, 0}),
                    {scene.camera.right, scene.camera.up, scene.camera.forward},
                    1 / scene.camera.tan_half_fov_y};
  world.center = geometry.bounds().center();
  world.radius = geometry.bounds().empty() ? -std::numeric_limits<float>::infinity()
                                           : 0.5f * geometry.bounds().diagonal();
  world.look = scene.look;
  world.white = white_level(suns, lamps, state.sky);
  world.max_depth = std::max(1, image.max_depth);
  world.direct_only = image.max_depth == 0;  // direct light only
  world.has_glass = has_glass(scene);
  world.shadow_only = scene.ground.shadow_only;
  world.transparent = image.transparent || scene.ground.shadow_only;
  world.time = scene.time;
  const CameraMotion motion =
      scene.camera_motion.value_or(CameraMotion{scene.camera, scene.camera, scene.camera});
  job.camera = {scene.camera,   scene.camera_motion.has_value(), motion.opening,
                motion.closing, {image.width, image.height},     &state.filter};
  job.next_camera = motion.next;
  job.meshes_move = std::any_of(scene.meshes.begin(), scene.meshes.end(),
                                [](const RenderMesh& mesh) { return mesh.moves; });
  job.image = image;
  job.sampler = make_frame_sampler(image.seed, settings.frame, image.samples, image.steady);
  const bool smooth = is_smoothed(image, scene.camera);
  // If a pixel has only one sample and is smoothed, the sample is that of the pixel's centre, whose
  // hit the CPU knows from the AOVs. On silhouettes smooth_noise() mixes neighbouring pixels'
  // colours anyway, but not their alpha.
  job.samples_centers = smooth && image.samples == 1 && !world.transparent;
  if (job.samples_centers) job.camera.filter = &state.center_filter;
  job.aovs = choose_aovs(smooth ? layers_to_smooth(image.aovs) : image.aovs);
  const Mattes mattes(image.aovs, scene);
  job.mattes = &mattes;
  job.samples = part ? *part : SampleRange{0, image.samples, image.samples};
  MatteSums matte_sums;
  if (part) {
    job.first_aov = static_cast<int>(list_node_channels(*part).size());
    matte_sums = make_matte_sums(*part, image, mattes);
    job.part_mattes = &matte_sums.sums;
  }
  state.stats = {};
  state.stats.build_seconds = build_watch.seconds();

  // Trace the samples on the GPU if it can. The CPU does the rest: mattes and guides, or
  // everything.
  const Stopwatch trace_watch;
  Image film = make_image(image.width, image.height, list_traced_channels(job, part));
  film.attributes = mattes.attributes();
  const int columns = (image.width + kTile - 1) / kTile, rows = (image.height + kTile - 1) / kTile;
  // Statistics per tile, and last those of the GPU.
  std::vector<RayStats> tile_stats(static_cast<std::size_t>(columns) * rows + 1);
  DeviceFilm device_film;
  if (state.trace_on_device(job, device_film, tile_stats.back())) job.device_film = &device_film;
  double hierarchy_seconds = 0;
  if (!job.device_film || needs_first_hits(job)) {
    const Stopwatch hierarchy_watch;
    PM_TRY_STATUS(geometry.build_hierarchy(state.device));
    hierarchy_seconds = hierarchy_watch.seconds();
  }
  parallel_for(columns * rows, [&](std::int64_t i) {
    const int tile = static_cast<int>(i);
    render_tile(job, tile % columns, tile / columns, film, tile_stats[i]);
  });
  PM_TRY_STATUS(take_device_error(state.device));
  for (const RayStats& stats : tile_stats) {
    state.stats.rays += stats.rays;
    state.stats.paths += stats.paths;
  }
  state.stats.build_seconds += hierarchy_seconds;
  state.stats.trace_seconds = trace_watch.seconds() - hierarchy_seconds;
  // Make the picture or part from the film.
  std::vector<std::string> channels = list_film_channels(choose_aovs(image.aovs));
  for (std::string& channel : mattes.channels()) channels.push_back(std::move(channel));
  if (part) {
    add_part_attributes(*part, channels, smooth, film);
    return append_matte_sums(std::move(film), *part, matte_sums);
  }
  if (smooth) {
    smooth_noise(film);
    return select_channels(std::move(film), std::move(channels));
  }
  if (!image.denoise) return film;
  const Stopwatch denoise_watch;
  PM_TRY_STATUS(state.denoiser->denoise(film));
  state.stats.denoise_seconds = denoise_watch.seconds();
  return film;
}

std::uint64_t picture_bytes(const ImageSettings& image, const std::optional<SampleRange>& part) {
  std::size_t channels = list_film_channels(choose_aovs(image.aovs)).size();
  const Mattes matte_layers(image.aovs, RenderScene{});
  channels += matte_layers.channels().size();
  if (image.denoise) channels += list_guide_channels().size();
  // Estimated bytes per pixel, layer and node: sums of a few ids, and their channels.
  constexpr std::size_t kMatteSumBytes = 128;
  std::uint64_t matte_bytes = 0;
  if (part) {
    channels += list_node_channels(*part).size();
    matte_bytes = kMatteSumBytes * matte_layers.layer_count() * list_nodes(*part).size() *
                  static_cast<std::uint64_t>(image.width) *
                  static_cast<std::uint64_t>(image.height);
  }
  const bool smooth = image.smooth && !image.denoise;
  if (smooth) channels += 2 * choose_aovs(kSmoothLayers).size();
  return matte_bytes + (smooth ? smooth_bytes(image.width, image.height) : 0) +
         sizeof(float) * channels * static_cast<std::uint64_t>(image.width) *
             static_cast<std::uint64_t>(image.height);
}

Status check_denoiser() {
  const auto denoiser = Denoiser::open();
  if (!denoiser) return denoiser.error();
  return Ok{};
}

void Renderer::set_device_tracer(std::unique_ptr<DeviceTracer> tracer) {
  state_->device_tracer = std::move(tracer);
}

bool Renderer::traced_on_cpu() const {
  return !state_->device_tracer || !state_->device_obstacle.empty();
}

Renderer::Stats Renderer::stats() const { return state_->stats; }
std::string Renderer::isa() const { return state_->device.isa; }

}  // namespace polymorph
