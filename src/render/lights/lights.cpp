#include "render/lights/lights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/parallel.h"

namespace polymorph {
namespace {

/// A distant rectangular light behind a diffuser: soft edges, a little brighter in the middle.
struct SoftBox {
  float azimuth,
      elevation;  ///< direction of its centre, degrees; azimuth from the camera's side towards its
                  ///< right
  float width, height;  ///< half sizes on the plane at distance 1
  float edge;           ///< width of the soft edge there
  Vec3 radiance;
};

// Arranged for clear reflections in a chrome ball: a large light overhead, a tall one on the key's
// side, a thin bright edge on the other, one behind; dark in between. Warm and cool lights are
// balanced to grey. Brightness is relative: the sum is scaled to kStudioIrradiance.
constexpr std::array<SoftBox, 4> kSoftBoxes = {{
    {0, 84, 0.80f, 0.48f, 0.22f, {2.6f, 2.6f, 2.6f}},
    {-70, 26, 0.26f, 0.60f, 0.12f, {2.2f, 2.1f, 1.95f}},
    {82, 22, 0.14f, 0.70f, 0.10f, {1.9f, 2.0f, 2.15f}},
    {152, 34, 0.55f, 0.20f, 0.14f, {2.0f, 2.05f, 2.15f}},
}};
// Irradiance on the floor from the soft boxes and the room at sky_intensity 1: with the default key
// light the brightest parts of a white object are just below white.
constexpr float kStudioIrradiance = 1.6f;

/// Coverage: 1 inside the box on the plane at distance 1, 0 outside, smooth between; rounded
/// corners.
float soft_box_cover(const SoftBox& box, Vec3 d) {
  const float a = radians(box.azimuth), e = radians(box.elevation);
  const Vec3 center = direction_at(a, e);
  const Vec3 sideways{cosine(a), 0, -sine(a)};
  const Vec3 upward = cross(center, sideways);
  const float facing = dot(d, center);
  if (facing <= 0.01f) return 0;
  const float x = std::fabs(dot(d, sideways) / facing), y = std::fabs(dot(d, upward) / facing);
  const float outside = std::sqrt(square(std::max(x - box.width + box.edge, 0.0f)) +
                                  square(std::max(y - box.height + box.edge, 0.0f)));
  const float cover = 1 - smoothstep(0, box.edge, outside);
  const float middle = 1 - 0.3f * clamp01(square(x / box.width) + square(y / box.height));
  return cover * middle;
}

/// Weight of the floor's colour in the wall at this height: a paper sweep without a horizon line.
float sweep_weight(Vec3 d) { return 1 - smoothstep(0, 0.30f, d.y); }

/// The studio without the sweep, in rig space.
Vec3 studio_radiance(Vec3 d) {
  if (d.y <= 0) return {};
  // The dark room, slightly lighter at the top.
  Vec3 sum = lerp(Vec3{0.16f, 0.165f, 0.175f}, Vec3{0.36f, 0.365f, 0.38f}, smoothstep(0, 1, d.y)) *
             smoothstep(0, 0.35f, d.y);
  for (const SoftBox& box : kSoftBoxes) sum = sum + box.radiance * soft_box_cover(box, d);
  return sum;
}

}  // namespace

Frame make_rig(const Camera& camera) {
  Vec3 backward{-camera.forward.x, 0, -camera.forward.z};
  // When looking straight down (up), the image's lower (upper) edge is the camera's side.
  if (dot(backward, backward) < 1e-6f)
    backward = Vec3{camera.up.x, 0, camera.up.z} * camera.forward.y;
  backward = normalized(backward);
  if (!(dot(backward, backward) > 0.5f)) backward = {0, 0, 1};
  const Vec3 up{0, 1, 0};
  return {cross(up, backward), up, backward};
}

namespace {

KeyLight make_disc(float azimuth, float elevation, float size, Vec3 irradiance,
                   const Camera& camera) {
  const float a = radians(azimuth), e = radians(elevation);
  KeyLight key;
  key.frame = make_frame(normalized(to_world(make_rig(camera), direction_at(a, e))));
  key.irradiance = irradiance;
  key.sample_power = irradiance;
  if (size > 0) {
    const float radius = std::clamp(0.5f * radians(size), 1e-3f, 0.5f * kPi);
    const float sin_radius = sine(radius);
    key.cos_radius = cosine(radius);
    key.sin_radius = sin_radius;
    // 1 - cos would cancel for small discs.
    key.pdf = 1 / (4 * kPi * square(sine(0.5f * radius)));
    key.radiance = irradiance / (kPi * sin_radius * sin_radius);
    key.sample_power = key.radiance / key.pdf;
  }
  return key;
}

}  // namespace

KeyLight make_key_light(const LightSettings& settings, const Camera& camera) {
  return make_disc(settings.key_azimuth, settings.key_elevation, settings.key_size,
                   settings.key_color * settings.key_intensity, camera);
}

KeyLight make_sun(const LampSettings& settings, const Camera& camera) {
  return make_disc(settings.azimuth, settings.elevation, settings.size,
                   settings.color * settings.intensity, camera);
}

Sky make_studio_sky(const Frame& rig, const KeyLight& key, Vec3 floor, float scale, SkyPart part) {
  Sky sky;
  sky.width = 256;
  sky.height = 128;
  const std::size_t count = static_cast<std::size_t>(sky.width) * sky.height;
  sky.texels.resize(count);
  std::vector<float> sweep(count);
  parallel_for(sky.height, [&](std::int64_t y) {
    for (int x = 0; x < sky.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * sky.width + x;
      const Vec3 d = to_local(
          rig, sky_direction(sky, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
      sky.texels[i] = studio_radiance(d);
      sweep[i] = sweep_weight(d);
    }
  });
  // The floor's radiance L lights itself through the sweep: L = floor / pi (key + sky + L share).
  const Vec3 mean = upper_mean(sky, [&](std::size_t i) { return sky.texels[i]; });
  const float share = upper_mean(sky, [&](std::size_t i) { return Vec3{sweep[i], 0, 0}; }).x;
  const float level = scale * kStudioIrradiance * kInvPi / mean.y;
  const Vec3 direct =
      floor * (key.irradiance * (kInvPi * std::max(0.0f, key.frame.z.y)) + mean * level);
  const Vec3 returned = floor * share;
  const Vec3 lit{direct.x / (1 - returned.x), direct.y / (1 - returned.y),
                 direct.z / (1 - returned.z)};
  for (std::size_t i = 0; i < count; ++i) sky.texels[i] = sky.texels[i] * level + lit * sweep[i];
  sky.calm_level = std::numeric_limits<float>::infinity();
  prepare_sky(sky, part);
  return sky;
}

}  // namespace polymorph
