#include "render/lights/lights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/parallel.h"

namespace polymorph {
namespace {

/// A distant rectangular light with soft edges, a little brighter in the middle.
struct SoftBox {
  /// Direction of the centre, degrees; azimuth 0 is towards the camera, 90 to its right.
  float azimuth, elevation;
  float half_width, half_height;  ///< half sizes on the tangent plane at distance 1
  float edge;                     ///< width of the soft edge on that plane
  Vec3 radiance;
};

// The lights are arranged for clear reflections in a chrome ball: a large one overhead, a tall one
// on the key light's side, a thin one on the other side, and one behind, with dark gaps. Warm and
// cool lights are balanced to grey. Radiances are relative: their sum is scaled to
// kStudioIrradiance.
constexpr std::array<SoftBox, 4> kSoftBoxes = {{
    {0, 84, 0.80f, 0.48f, 0.22f, {2.6f, 2.6f, 2.6f}},
    {-70, 26, 0.26f, 0.60f, 0.12f, {2.2f, 2.1f, 1.95f}},
    {82, 22, 0.14f, 0.70f, 0.10f, {1.9f, 2.0f, 2.15f}},
    {152, 34, 0.55f, 0.20f, 0.14f, {2.0f, 2.05f, 2.15f}},
}};
// Irradiance of the floor by the soft boxes and the room at sky_intensity 1. With the default key
// light the brightest parts of a white object are then just below white.
constexpr float kStudioIrradiance = 1.6f;

/// Computes the relative brightness of a box in a direction: 1 at its centre, 0 outside, with
/// smooth edges and rounded corners.
float soft_box_brightness(const SoftBox& box, Vec3 d) {
  const float a = radians(box.azimuth), e = radians(box.elevation);
  const Vec3 center = direction_at(a, e);
  const Vec3 sideways{cosine(a), 0, -sine(a)};
  const Vec3 upward = cross(center, sideways);
  const float facing = dot(d, center);
  if (facing <= 0.01f) return 0;  // d misses the tangent plane, or meets it far away
  const float x = std::fabs(dot(d, sideways) / facing), y = std::fabs(dot(d, upward) / facing);
  const float edge_distance = std::sqrt(square(std::max(x - box.half_width + box.edge, 0.0f)) +
                                        square(std::max(y - box.half_height + box.edge, 0.0f)));
  const float coverage = 1 - smoothstep(0, box.edge, edge_distance);
  const float center_gain =
      1 - 0.3f * clamp01(square(x / box.half_width) + square(y / box.half_height));
  return coverage * center_gain;
}

/// Weight of the floor's radiance in this direction. It falls off smoothly above the horizon, as if
/// the floor were a sweep (a paper that curves upwards), so no horizon line shows.
float sweep_weight(Vec3 d) { return 1 - smoothstep(0, 0.30f, d.y); }

/// Computes the radiance of the studio without the sweep. `d` is in the rig's frame.
Vec3 studio_radiance(Vec3 d) {
  if (d.y <= 0) return {};
  // The dark room is slightly lighter at the top.
  Vec3 sum = lerp(Vec3{0.16f, 0.165f, 0.175f}, Vec3{0.36f, 0.365f, 0.38f}, smoothstep(0, 1, d.y)) *
             smoothstep(0, 0.35f, d.y);
  for (const SoftBox& box : kSoftBoxes) sum = sum + box.radiance * soft_box_brightness(box, d);
  return sum;
}

}  // namespace

Frame make_rig(const Camera& camera) {
  Vec3 backward{-camera.forward.x, 0, -camera.forward.z};
  // When the camera looks straight down (up), `backward` points to the image's lower (upper) edge.
  if (dot(backward, backward) < 1e-6f)
    backward = Vec3{camera.up.x, 0, camera.up.z} * camera.forward.y;
  backward = normalized(backward);
  if (!(dot(backward, backward) > 0.5f)) backward = {0, 0, 1};
  const Vec3 up{0, 1, 0};
  return {cross(up, backward), up, backward};
}

namespace {

/// Makes a round light in a direction relative to the camera. `size`: its angular diameter; angles
/// are in degrees.
DistantLight make_disc(float azimuth, float elevation, float size, Vec3 irradiance,
                       const Camera& camera) {
  const float a = radians(azimuth), e = radians(elevation);
  DistantLight light;
  light.frame = make_frame(normalized(to_world(make_rig(camera), direction_at(a, e))));
  light.irradiance = irradiance;
  light.sample_power = irradiance;
  if (size > 0) {
    // The limits are almost a point and a hemisphere.
    const float radius = std::clamp(0.5f * radians(size), 1e-3f, 0.5f * kPi);
    const float sin_radius = sine(radius);
    light.cos_radius = cosine(radius);
    light.sin_radius = sin_radius;
    // 1 / solid angle; 1 - cos(radius) would cancel for small discs.
    light.pdf = 1 / (4 * kPi * square(sine(0.5f * radius)));
    light.radiance = irradiance / (kPi * sin_radius * sin_radius);
    light.sample_power = light.radiance / light.pdf;
  }
  return light;
}

}  // namespace

DistantLight make_key_light(const LightSettings& settings, const Camera& camera) {
  return make_disc(settings.key_azimuth, settings.key_elevation, settings.key_size,
                   settings.key_color * settings.key_intensity, camera);
}

DistantLight make_sun(const LampSettings& settings, const Camera& camera) {
  return make_disc(settings.azimuth, settings.elevation, settings.size,
                   settings.color * settings.intensity, camera);
}

Sky make_studio_sky(const Frame& rig, const DistantLight& key, Vec3 floor, float scale,
                    SkyDomain domain) {
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
  // The floor's radiance L includes light from the sweep, which shows the floor itself:
  // L = floor (key / pi + gain mean + L sweep_mean). The means are cosine-weighted.
  const Vec3 mean = upper_mean(sky, [&](std::size_t i) { return sky.texels[i]; });
  const float sweep_mean = upper_mean(sky, [&](std::size_t i) { return Vec3{sweep[i], 0, 0}; }).x;
  const float gain = scale * kStudioIrradiance * kInvPi / mean.y;  // green, as the light is grey
  const Vec3 direct =
      floor * (key.irradiance * (kInvPi * std::max(0.0f, key.frame.z.y)) + mean * gain);
  const Vec3 returned_fraction = floor * sweep_mean;
  const Vec3 floor_radiance{direct.x / (1 - returned_fraction.x),
                            direct.y / (1 - returned_fraction.y),
                            direct.z / (1 - returned_fraction.z)};
  for (std::size_t i = 0; i < count; ++i)
    sky.texels[i] = sky.texels[i] * gain + floor_radiance * sweep[i];
  sky.calm_level = std::numeric_limits<float>::infinity();  // the whole sky is calm
  prepare_sky(sky, domain);
  return sky;
}

}  // namespace polymorph
