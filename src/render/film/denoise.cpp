#include "render/film/denoise.h"

#include <dlfcn.h>

#include <cstdlib>

#include "base/parallel.h"
#include "render/materials/glass.h"
#include "render/path/path.h"
#include "render/path/surface_shading.h"

namespace polymorph {
namespace {

constexpr const char* kLibrary = "libOpenImageDenoise.so.2";
constexpr int kGuideChannels = 6;
constexpr int kMaxGuideBounces = 8;  // mirrors and glass boundaries
// Metals smoother than this count as mirrors, whose guide is that of the reflected surface.
constexpr float kMirrorRoughness = 0.25f;

/// Functions of OpenImageDenoise/oidn.h, version 2.
struct Library {
  void* (*new_device)(int type) = nullptr;
  void (*set_device_int)(void* device, const char* name, int value) = nullptr;
  void (*set_device_bool)(void* device, const char* name, bool value) = nullptr;
  void (*commit_device)(void* device) = nullptr;
  int (*device_error)(void* device, const char** text) = nullptr;
  void (*release_device)(void* device) = nullptr;
  void* (*new_filter)(void* device, const char* type) = nullptr;
  void (*set_image)(void* filter, const char* name, void* pixels, int format, std::size_t width,
                    std::size_t height, std::size_t offset, std::size_t pixel_stride,
                    std::size_t row_stride) = nullptr;
  void (*set_filter_bool)(void* filter, const char* name, bool value) = nullptr;
  void (*commit_filter)(void* filter) = nullptr;
  void (*execute_filter)(void* filter) = nullptr;
  void (*release_filter)(void* filter) = nullptr;
};
constexpr int kDeviceCpu = 1, kFormatFloat3 = 3;  // OIDN_DEVICE_TYPE_CPU, OIDN_FORMAT_FLOAT3

Result<Library> load_library() {
  const char* chosen = std::getenv("POLYMORPH_OIDN");
  const std::string file = chosen && *chosen ? chosen : kLibrary;
  void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    const char* reason = dlerror();
    return make_error(ErrorCode::kResource,
                      "cannot denoise: {} - get Open Image Denoise 2 from openimagedenoise.org or "
                      "by \"pip install pyoidn\", name its {} in POLYMORPH_OIDN, or render without "
                      "image.denoise",
                      reason ? reason : "no reason given", kLibrary);
  }
  Library library;
  bool is_complete = true;
  const auto find = [&](auto& function, const char* name) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(handle, name));
    is_complete = is_complete && function;
  };
  find(library.new_device, "oidnNewDevice");
  find(library.set_device_int, "oidnSetDeviceInt");
  find(library.set_device_bool, "oidnSetDeviceBool");
  find(library.commit_device, "oidnCommitDevice");
  find(library.device_error, "oidnGetDeviceError");
  find(library.release_device, "oidnReleaseDevice");
  find(library.new_filter, "oidnNewFilter");
  find(library.set_image, "oidnSetSharedFilterImage");
  find(library.set_filter_bool, "oidnSetFilterBool");
  find(library.commit_filter, "oidnCommitFilter");
  find(library.execute_filter, "oidnExecuteFilter");
  find(library.release_filter, "oidnReleaseFilter");
  if (is_complete) return library;  // the library stays loaded
  dlclose(handle);
  return make_error(ErrorCode::kResource,
                    "cannot denoise: {} is not version 2 of Open Image Denoise - name another file "
                    "in POLYMORPH_OIDN, or render without image.denoise",
                    file);
}

}  // namespace

Guide trace_guide(const World& world, Ray ray, Intersection intersection, RayStats& stats) {
  Vec3 tint{1, 1, 1};
  for (int bounce = 0;; ++bounce) {
    if (intersection.mesh.mesh == kNoMesh) {
      if (intersection.floor == std::numeric_limits<float>::infinity()) break;
      const FloorPointOf<Vec3> point = floor_point(world.floor, ray, intersection.floor);
      return {tint * min(world.floor.color * point.tone, {1, 1, 1}), {0, 1, 0}};
    }
    const SurfacePoint point = world.geometry->surface_point(ray, intersection.mesh);
    const Shading shading = mixed_shading(world, intersection.mesh);
    const bool glass = shading.transmission > 0.5f;
    const bool mirror = shading.metallic > 0.5f && shading.roughness < kMirrorRoughness;
    if (bounce == kMaxGuideBounces || (!glass && !mirror))
      return {tint * min(shading.color, {1, 1, 1}), point.shading};
    const float cosine = -dot(ray.direction, point.shading);
    const float eta = point.inside ? shading.ior : 1 / shading.ior;
    // Continue along the stronger of reflection and refraction.
    const bool is_refracted = glass && dielectric_fresnel(cosine, eta) < 0.5f;
    if (glass && is_refracted && !point.inside) tint = tint * glass_tint(shading);
    if (mirror && !glass) tint = tint * min(shading.color, {1, 1, 1});
    const float epsilon = world.epsilon;
    ray.origin = is_refracted ? point.position - point.normal * epsilon
                              : point.position + point.normal * epsilon;
    ray.direction = is_refracted ? refracted(ray.direction, point.shading, eta)
                                 : normalized(ray.direction + point.shading * (2 * cosine));
    ray.far = std::numeric_limits<float>::infinity();
    ++stats.rays;
    intersection.floor = intersect_floor(world.floor, ray);
    ray.far = intersection.floor;
    intersection.mesh = world.geometry->closest(ray);
  }
  // The studio's paper has no features, so its albedo is 1. A tinted ray comes from a mirror or
  // from glass, which show the sky instead.
  if (tint == Vec3{1, 1, 1} && !world.backdrop.shows_sky) return {{1, 1, 1}, /*normal=*/{}};
  return {tint * min(max(sky_radiance(world.sky, ray.direction), {}), {1, 1, 1}), /*normal=*/{}};
}

std::vector<std::string> list_guide_channels() {
  return {"guide.albedo.R", "guide.albedo.G", "guide.albedo.B",
          "guide.normal.X", "guide.normal.Y", "guide.normal.Z"};
}

struct Denoiser::State {
  Library library;
  void* device = nullptr;
  ~State() {
    if (device) library.release_device(device);
  }
  Status error() const {
    const char* text = nullptr;
    if (library.device_error(device, &text) == 0) return Ok{};
    return make_error(ErrorCode::kResource, "Open Image Denoise failed: {}",
                      text ? text : "no reason given");
  }

  /// Runs the network once on three channels from `first`, as the input `name`. With `guides` it
  /// uses both guides, otherwise none.
  Status filter_channels(Image& film, const char* name, std::size_t first, bool guides) const {
    void* filter = library.new_filter(device, "RT");
    if (!filter) return error();
    const std::size_t stride = film.channel_count() * sizeof(float);
    const auto set_input = [&](const char* what, std::size_t channel) {
      library.set_image(filter, what, film.pixels.data(), kFormatFloat3,
                        static_cast<std::size_t>(film.width), static_cast<std::size_t>(film.height),
                        channel * sizeof(float), stride,
                        stride * static_cast<std::size_t>(film.width));
    };
    set_input(name, first);
    set_input("output", first);
    if (guides) {
      const std::size_t albedo = film.channel_count() - kGuideChannels;
      set_input("albedo", albedo);
      set_input("normal", albedo + 3);
      library.set_filter_bool(filter, "hdr", true);
      library.set_filter_bool(filter, "cleanAux", true);  // the guides are denoised already
    }
    library.commit_filter(filter);
    library.execute_filter(filter);
    library.release_filter(filter);
    return error();
  }
};

Denoiser::Denoiser(std::unique_ptr<State> state) : state_(std::move(state)) {}
Denoiser::~Denoiser() = default;
Denoiser::Denoiser(Denoiser&&) noexcept = default;
Denoiser& Denoiser::operator=(Denoiser&&) noexcept = default;

Result<Denoiser> Denoiser::open() {
  auto state = std::make_unique<State>();
  PM_TRY(state->library, load_library());
  state->device = state->library.new_device(kDeviceCpu);
  if (!state->device)
    return make_error(ErrorCode::kResource, "cannot denoise: Open Image Denoise gives no device");
  state->library.set_device_int(state->device, "numThreads", thread_count());
  state->library.set_device_bool(state->device, "setAffinity", false);
  state->library.commit_device(state->device);
  PM_TRY_STATUS(state->error());
  return Denoiser(std::move(state));
}

Status Denoiser::denoise(Image& film) {
  const std::size_t channels = film.channel_count(), result_channels = channels - kGuideChannels;
  PM_CHECK(channels > kGuideChannels &&
           film.channels[result_channels] == list_guide_channels().front());
  // Denoise the guides first: lens, shutter and few samples leave noise in them too.
  PM_TRY_STATUS(state_->filter_channels(film, "albedo", result_channels, /*guides=*/false));
  PM_TRY_STATUS(state_->filter_channels(film, "normal", result_channels + 3, /*guides=*/false));
  PM_TRY_STATUS(state_->filter_channels(film, "color", 0, /*guides=*/true));
  Image result = make_image(
      film.width, film.height,
      {film.channels.begin(), film.channels.begin() + static_cast<long>(result_channels)});
  for (std::size_t i = 0, k = 0; i < result.pixels.size(); i += result_channels, k += channels)
    for (std::size_t c = 0; c < result_channels; ++c) result.pixels[i + c] = film.pixels[k + c];
  result.attributes = std::move(film.attributes);
  film = std::move(result);
  return Ok{};
}

}  // namespace polymorph
