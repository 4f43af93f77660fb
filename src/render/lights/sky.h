// Environment light: a latitude-longitude table of radiance, split into a calm part, whose light on
// an unshadowed surface is known beforehand, and what is far above it (a sun, a lamp), which is
// sampled by brightness.
#pragma once

#include <vector>

#include "image/image.h"
#include "kernels/types.h"
#include "render/math/vector_math.h"

namespace polymorph {

/// Directions that sample_bright_sky may return.
enum class SkyPart : unsigned char {
  kAll,
  kAboveHorizon,  ///< the ground below is found by tracing rays, not by sampling
};

/// A pdf over directions, constant in each cell of a lat-long grid.
struct SkyDistribution {
  int width = 0, height = 0;
  std::vector<float> row_cdf;     ///< height + 1
  std::vector<float> column_cdf;  ///< height * (width + 1)
  std::vector<float> pdf;         ///< per solid angle, height * width
  float total = 0;                ///< integral of the sampled function
};

/// A latitude-longitude table of radiance. Row 0 is the zenith (+y); the middle column looks along
/// -z, the one a quarter to its right along +x.
struct Sky {
  int width = 0, height = 0;
  std::vector<Vec3> texels;
  float calm_level = 0;  ///< luminance above which radiance counts as bright
  bool has_bright = false;
  SkyDistribution distribution;  ///< distribution of the bright part
  std::vector<Vec3>
      irradiance;         ///< irradiance of the calm part: octahedral grid of normals, see sky.cpp
  Vec3 upper_irradiance;  ///< irradiance of the calm part on a floor (normal +y) from above
};

/// Finishes a sky whose width, height, texels and calm_level are set. Texels must be finite and >=
/// 0.
void prepare_sky(Sky& sky, SkyPart part);

/// The direction of the point (x, y), in texels.
Vec3 sky_direction(const Sky& sky, float x, float y);

/// Cosine-weighted mean of value(index of the texel) over the upper half: irradiance / pi.
template <class F>
Vec3 upper_mean(const Sky& sky, const F& value) {
  double sum[3] = {0, 0, 0}, cosines = 0;
  for (int y = 0; y < sky.height / 2; ++y) {
    const Vec3 d = sky_direction(sky, 0.5f, static_cast<float>(y) + 0.5f);
    const double weight = d.y * std::sqrt(std::max(0.0f, 1 - d.y * d.y));
    for (int x = 0; x < sky.width; ++x) {
      const Vec3 v = value(static_cast<std::size_t>(y) * static_cast<std::size_t>(sky.width) +
                           static_cast<std::size_t>(x));
      sum[0] += weight * v.x;
      sum[1] += weight * v.y;
      sum[2] += weight * v.z;
    }
    cosines += weight * sky.width;
  }
  return {static_cast<float>(sum[0] / cosines), static_cast<float>(sum[1] / cosines),
          static_cast<float>(sum[2] / cosines)};
}

/// Makes a sky from a lat-long image (channels R G B, or the first one as grey) times `scale`.
/// Negative and non-finite pixels count as black.
Sky make_image_sky(const Image& image, float scale, SkyPart part);

/// Radiance from a direction, interpolated bilinearly.
Vec3 sky_radiance(const Sky& sky, Vec3 direction);
Pack3 sky_radiance(const Sky& sky, const Pack3& direction);

/// Calm and bright part of a radiance; their sum is the total.
template <class T3>
struct SkySplitOf {
  T3 calm, bright;
};
using SkySplit = SkySplitOf<Vec3>;
template <class T3>
inline SkySplitOf<T3> split_radiance(const Sky& sky, T3 radiance) {
  const ComponentOf<T3> light = luminance(radiance);
  const T3 calm = select(light <= sky.calm_level, radiance, radiance * (sky.calm_level / light));
  return {calm, radiance - calm};
}

/// A direction sampled by the brightness of the bright part.
struct SkySample {
  Vec3 direction;
  float pdf;  ///< per solid angle; 0 = nothing to sample
};
SkySample sample_bright_sky(const Sky& sky, float u, float v);
float bright_sky_pdf(const Sky& sky, Vec3 direction);
Pack bright_sky_pdf(const Sky& sky, const Pack3& direction);

/// Irradiance of an unshadowed surface with this unit normal from the calm part: integral of
/// radiance times cosine.
Vec3 sky_irradiance(const Sky& sky, Vec3 normal);
Pack3 sky_irradiance(const Sky& sky, const Pack3& normal);

}  // namespace polymorph
