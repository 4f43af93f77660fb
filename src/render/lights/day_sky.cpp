#include "render/lights/day_sky.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "render/math/vector_math.h"

namespace polymorph {
namespace {

float exponential(float x) { return static_cast<float>(exact::exp(static_cast<double>(x))); }
float angle_from_cosine(float cosine) {
  return static_cast<float>(exact::acos(static_cast<double>(cosine)));
}

/// Perez' sky function for one of Y, x, y, given by five coefficients (Preetham et al., appendix
/// A.2).
struct Perez {
  float a, b, c, d, e;
  /// Evaluates the function at an angle from the zenith and an angle `gamma` from the sun, in
  /// radians.
  float at(float cos_zenith, float gamma, float cos_gamma) const {
    return (1 + a * exponential(b / std::max(cos_zenith, 0.01f))) *  // finite at the horizon
           (1 + c * exponential(d * gamma) + e * cos_gamma * cos_gamma);
  }
};

/// Coefficients of the model for a turbidity and an elevation of the sun (Preetham et al., appendix
/// A.2).
struct DayModel {
  Perez luminance, x, y;
  float zenith_x, zenith_y;     ///< chromaticity of the zenith
  float sun_angle, sun_cosine;  ///< angle of the sun from the zenith, in radians, and its cosine

  DayModel(float turbidity, float cos_sun) {
    const float t = turbidity;
    luminance = {0.1787f * t - 1.4630f, -0.3554f * t + 0.4275f, -0.0227f * t + 5.3251f,
                 0.1206f * t - 2.5771f, -0.0670f * t + 0.3703f};
    x = {-0.0193f * t - 0.2592f, -0.0665f * t + 0.0008f, -0.0004f * t + 0.2125f,
         -0.0641f * t - 0.8989f, -0.0033f * t + 0.0452f};
    y = {-0.0167f * t - 0.2608f, -0.0950f * t + 0.0092f, -0.0079f * t + 0.2102f,
         -0.0441f * t - 1.6537f, -0.0109f * t + 0.0529f};
    sun_cosine = cos_sun;
    sun_angle = angle_from_cosine(cos_sun);
    const float s = sun_angle, s2 = s * s, s3 = s2 * s;
    zenith_x = t * t * (0.00166f * s3 - 0.00375f * s2 + 0.00209f * s) +
               t * (-0.02903f * s3 + 0.06377f * s2 - 0.03202f * s + 0.00394f) +
               (0.11693f * s3 - 0.21196f * s2 + 0.06052f * s + 0.25886f);
    zenith_y = t * t * (0.00275f * s3 - 0.00610f * s2 + 0.00317f * s) +
               t * (-0.04214f * s3 + 0.08970f * s2 - 0.04153f * s + 0.00516f) +
               (0.15346f * s3 - 0.26756f * s2 + 0.06670f * s + 0.26688f);
  }

  /// Computes the radiance relative to the zenith's luminance, in linear Rec. 709.
  Vec3 radiance(float cos_zenith, float cos_gamma) const {
    const float gamma = angle_from_cosine(std::clamp(cos_gamma, -1.0f, 1.0f));
    const auto relative = [&](const Perez& p) {
      return p.at(cos_zenith, gamma, cos_gamma) / p.at(1, sun_angle, sun_cosine);
    };
    const float big_y = relative(luminance);
    const float cx = zenith_x * relative(x), cy = std::max(zenith_y * relative(y), 1e-3f);
    const float big_x = cx / cy * big_y, big_z = (1 - cx - cy) / cy * big_y;
    // XYZ to Rec. 709.
    return max({3.2406f * big_x - 1.5372f * big_y - 0.4986f * big_z,
                -0.9689f * big_x + 1.8758f * big_y + 0.0415f * big_z,
                0.0557f * big_x - 0.2040f * big_y + 1.0570f * big_z},
               Vec3{});
  }
};

}  // namespace

Sky make_day_sky(const DistantLight& sun, Vec3 floor, float turbidity, float scale,
                 SkyDomain domain) {
  Sky sky;
  sky.width = 512;
  sky.height = 256;
  const auto width = static_cast<std::size_t>(sky.width);
  sky.texels.resize(width * static_cast<std::size_t>(sky.height));
  const DayModel model(turbidity, std::clamp(sun.frame.z.y, 0.01f, 1.0f));
  const auto direction = [&](int x, int y) {
    return sky_direction(sky, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
  };
  const int horizon = sky.height / 2;
  parallel_for(horizon, [&](std::int64_t y) {
    for (int x = 0; x < sky.width; ++x) {
      const Vec3 d = direction(x, static_cast<int>(y));
      sky.texels[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] =
          model.radiance(d.y, dot(d, sun.frame.z));
    }
  });
  const Vec3 mean = upper_mean(sky, [&](std::size_t i) { return sky.texels[i]; });
  const float gain = scale * kDayIrradiance * kInvPi / std::max(luminance(mean), 1e-6f);
  const Vec3 ground =
      floor * (sun.irradiance * (kInvPi * std::max(0.0f, sun.frame.z.y)) + mean * gain);
  for (int y = 0; y < sky.height; ++y)
    for (std::size_t x = 0; x < width; ++x) {
      Vec3& texel = sky.texels[static_cast<std::size_t>(y) * width + x];
      texel = y < horizon ? texel * gain : ground;
    }
  // Haze: distant ground blends into the colour of the sky at the horizon above it.
  constexpr int kHazeRows = 10;  // 7 degrees
  for (int i = 0; i < kHazeRows; ++i) {
    const float haze = 0.75f * square(1 - (static_cast<float>(i) + 0.5f) / kHazeRows);
    for (std::size_t x = 0; x < width; ++x) {
      const Vec3 above = sky.texels[static_cast<std::size_t>(horizon - 1) * width + x];
      Vec3& texel = sky.texels[static_cast<std::size_t>(horizon + i) * width + x];
      texel = lerp(texel, above, haze);
    }
  }
  sky.calm_level = std::numeric_limits<float>::infinity();  // the whole sky is calm
  prepare_sky(sky, domain);
  return sky;
}

}  // namespace polymorph
