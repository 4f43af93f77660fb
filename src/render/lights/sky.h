// Environment light: a latitude-longitude table of radiance, split into a calm and a bright part.
// The irradiance of the calm part is tabulated. The bright part, all radiance above a level (a sun,
// a lamp), is importance-sampled.
#pragma once

#include <algorithm>
#include <vector>

#include "image/image.h"
#include "kernels/types.h"
#include "render/math/vector_math.h"

namespace polymorph {

/// Directions that sample_bright_sky() may return.
enum class SkyDomain : unsigned char {
  kAll,
  kAboveHorizon,  ///< rays below the horizon hit the floor
};

/// A pdf over directions, constant in each cell of a lat-long grid.
struct SkyDistribution {
  int width = 0, height = 0;
  std::vector<float> row_cdf;     ///< height + 1 entries, 0 to 1
  std::vector<float> column_cdf;  ///< per row: width + 1 entries, 0 to 1, or all 0 for a black row
  std::vector<float> pdf;         ///< per solid angle; height * width entries
  float total = 0;                ///< integral of the sampled function
};

/// A latitude-longitude table of radiance. Row 0 is the zenith (+y). The middle column is the
/// direction -z; a quarter of the width to its right is +x.
struct Sky {
  int width = 0, height = 0;
  std::vector<Vec3> texels;
  float calm_level = 0;  ///< luminance above which radiance counts as bright
  bool has_bright = false;
  SkyDistribution distribution;  ///< distribution of the bright part; empty unless has_bright
  std::vector<Vec3> irradiance;  ///< irradiance of the calm part on an octahedral grid of normals,
                                 ///< kIrradianceCells + 1 nodes per axis
  Vec3 upper_irradiance;         ///< irradiance of the calm part on a floor (normal +y) from above
};

/// Computes the members of a sky from `has_bright` on. The members before it must be set; texels
/// must be finite and >= 0.
void prepare_sky(Sky& sky, SkyDomain domain);

/// Returns the direction of the point (x, y), in texels.
Vec3 sky_direction(const Sky& sky, float x, float y);

/// Computes the cosine-weighted mean of value(index of the texel) over the upper half. For radiance
/// this is irradiance / pi.
template <class F>
Vec3 upper_mean(const Sky& sky, const F& value) {
  double sum[3] = {0, 0, 0}, cosines = 0;
  for (int y = 0; y < sky.height / 2; ++y) {
    const Vec3 d = sky_direction(sky, 0.5f, static_cast<float>(y) + 0.5f);
    // The cosine times the solid angle of a texel, up to a constant.
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
Sky make_image_sky(const Image& image, float scale, SkyDomain domain);

/// View of a sky's tables for lookups on the CPU or a GPU. Borrowed.
struct SkyTables {
  int width = 0, height = 0;
  const Vec3* texels = nullptr;
  float calm_level = 0;
  bool has_bright = false;
  int columns = 0, rows = 0;  ///< size of the distribution
  const float *row_cdf = nullptr, *column_cdf = nullptr, *pdf = nullptr;
  const Vec3* irradiance = nullptr;
  Vec3 upper_irradiance;
  SkyTables() = default;
  SkyTables(const Sky& sky);  // NOLINT(google-explicit-constructor): a view
};

inline constexpr int kIrradianceCells = 32;  ///< cells per axis of the octahedral grid of normals

/// Computes the latitude-longitude coordinates (column, row) of a direction, both in [0, 1].
template <class T3>
PM_HD Vec2Of<ComponentOf<T3>> lat_long(T3 d) {
  const ComponentOf<T3> horizontal = sqrt(d.x * d.x + d.z * d.z);
  return {0.5f + atan2_turns(d.x, -d.z), 0.5f - 2.0f * atan2_turns(d.y, horizontal)};
}

/// Octahedral map of the sphere (Cigolle et al. 2014, "A survey of efficient representations for
/// independent unit vectors"): maps a direction to [-1, 1]^2.
template <class T3>
PM_HD Vec2Of<ComponentOf<T3>> encode_octahedral(T3 d) {
  using V = ComponentOf<T3>;
  const V sum = abs(d.x) + abs(d.y) + abs(d.z);
  const V x = d.x / sum, y = d.z / sum;
  const MaskOf<T3> upper = d.y >= 0.0f;
  return {select(upper, x, copysign(1.0f - abs(y), x)),
          select(upper, y, copysign(1.0f - abs(x), y))};
}

/// Interpolates between four adjacent entries of a table: a pair of one row and one of the next.
template <class T3>
PM_HD T3 bilinear(const PairOf<T3>& upper, const PairOf<T3>& lower, ComponentOf<T3> fx,
                  ComponentOf<T3> fy) {
  return lerp(lerp(upper.first, upper.second, fx), lerp(lower.first, lower.second, fx), fy);
}

/// Looks up the radiance from a direction, interpolated bilinearly.
template <class T3>
PM_HD_CALL T3 sky_radiance(const SkyTables& sky, const T3& direction) {
  using V = ComponentOf<T3>;
  const Vec2Of<V> p = lat_long(direction);
  // clamp01() makes NaN 0, so that the index stays in range.
  const V x = clamp01(p.x) * static_cast<float>(sky.width) - 0.5f;
  const V y = min(max(p.y * static_cast<float>(sky.height) - 0.5f, 0.0f),
                  static_cast<float>(sky.height - 1));
  const auto row = truncate(y);
  const auto upper = row * sky.width, lower = min(row + 1, sky.height - 1) * sky.width;
  // The columns left and right of x wrap around: the first one follows the last one.
  const auto right = min(truncate(x + 1.0f), sky.width);
  const auto left = right - 1;
  const auto column = left + zero_unless(left < 0, sky.width),
             next = right - zero_unless(right >= sky.width, sky.width);
  return bilinear<T3>(gather_pair(sky.texels, upper + column, upper + next),
                      gather_pair(sky.texels, lower + column, lower + next), x - to_float(left),
                      y - to_float(row));
}

/// Returns the pdf of sample_bright_sky(), per solid angle.
template <class T3>
PM_HD ComponentOf<T3> bright_sky_pdf(const SkyTables& sky, const T3& direction) {
  if (!sky.has_bright) return broadcast<ComponentOf<T3>>(0);
  const auto p = lat_long(direction);
  const auto x = min(truncate(clamp01(p.x) * static_cast<float>(sky.columns)), sky.columns - 1);
  const auto y = min(truncate(clamp01(p.y) * static_cast<float>(sky.rows)), sky.rows - 1);
  return gather(sky.pdf, y * sky.columns + x);
}

/// Looks up the irradiance that an unoccluded surface with this unit normal receives from the calm
/// part.
template <class T3>
PM_HD_CALL T3 sky_irradiance(const SkyTables& sky, const T3& normal) {
  using V = ComponentOf<T3>;
  constexpr int kNodes = kIrradianceCells + 1;
  const Vec2Of<V> p = encode_octahedral(normal);
  const V x = clamp01((p.x + 1.0f) * 0.5f) * static_cast<float>(kIrradianceCells);
  const V y = clamp01((p.y + 1.0f) * 0.5f) * static_cast<float>(kIrradianceCells);
  const auto column = min(truncate(x), kIrradianceCells - 1);
  const auto row = min(truncate(y), kIrradianceCells - 1);
  const auto node = row * kNodes + column;
  return bilinear<T3>(gather_pair(sky.irradiance, node, node + 1),
                      gather_pair(sky.irradiance, node + kNodes, node + kNodes + 1),
                      x - to_float(column), y - to_float(row));
}

/// A radiance as the sum of its calm and its bright part.
template <class T3>
struct SkySplitOf {
  T3 calm, bright;
};
using SkySplit = SkySplitOf<Vec3>;
template <class T3>
PM_HD inline SkySplitOf<T3> split_radiance(const SkyTables& sky, T3 radiance) {
  const ComponentOf<T3> light = luminance(radiance);
  const T3 calm = select(light <= sky.calm_level, radiance, radiance * (sky.calm_level / light));
  return {calm, radiance - calm};
}

/// Result of sample_bright_sky().
template <class T3>
struct SkySampleOf {
  T3 direction;
  ComponentOf<T3> pdf;  ///< per solid angle; 0 = nothing to sample
};
using SkySample = SkySampleOf<Vec3>;
/// The interval [cdf[index], cdf[index + 1]] that contains a number u, and the fraction of the
/// interval below u.
struct CdfPick {
  int index;
  float fraction;
};
/// Finds this interval in a table of count + 1 ascending values from 0 to 1, for u in [0, 1).
PM_HD inline CdfPick pick_from_cdf(const float* cdf, int count, float u) {
  // This binary search replaces std::upper_bound(), which nvcc compiles without a warning but which
  // returns another entry on a GPU.
  int above = 0;
  for (int size = count + 1; size > 0;) {
    const int half = size / 2;
    const bool below = !(u < cdf[above + half]);
    above = below ? above + half + 1 : above;
    size = below ? size - half - 1 : half;
  }
  const int index = std::clamp(above - 1, 0, count - 1);
  const float width = cdf[index + 1] - cdf[index];
  return {index, width > 0 ? std::min((u - cdf[index]) / width, 0.999999f) : 0.5f};
}

/// Samples a direction in proportion to the bright part's luminance.
PM_HD inline SkySample sample_bright_sky(const SkyTables& sky, float u, float v) {
  if (!sky.has_bright || !(sky.row_cdf[sky.rows] > 0)) return {{0, 1, 0}, 0};
  const CdfPick row = pick_from_cdf(sky.row_cdf, sky.rows, v);
  const CdfPick column = pick_from_cdf(
      &sky.column_cdf[static_cast<std::size_t>(row.index) * (sky.columns + 1)], sky.columns, u);
  // Within a cell the direction is uniform in cos(theta), that is in solid angle.
  const auto cosine = [&](int y) {
    return cos_sin_turns(0.5f * static_cast<float>(y) / static_cast<float>(sky.rows)).x;
  };
  const float height = lerp(cosine(row.index), cosine(row.index + 1), row.fraction);
  const float horizontal = std::sqrt(std::max(0.0f, 1 - height * height));
  const Vec2 azimuth = cos_sin_turns((static_cast<float>(column.index) + column.fraction) /
                                         static_cast<float>(sky.columns) -
                                     0.5f);
  return {{azimuth.y * horizontal, height, -azimuth.x * horizontal},
          sky.pdf[static_cast<std::size_t>(row.index) * sky.columns + column.index]};
}

#if defined(PM_PACKS)
inline SkySampleOf<Pack3> sample_bright_sky(const SkyTables& sky, Pack u, Pack v) {
  SkySampleOf<Pack3> samples;
  for (int l = 0; l < kLanes; ++l) {
    const SkySample sample = sample_bright_sky(sky, u[l], v[l]);
    set_lane(samples.direction, l, sample.direction);
    samples.pdf[l] = sample.pdf;
  }
  return samples;
}
extern template Pack3 sky_radiance(const SkyTables&, const Pack3&);
extern template Pack bright_sky_pdf(const SkyTables&, const Pack3&);
extern template Pack3 sky_irradiance(const SkyTables&, const Pack3&);
#endif

}  // namespace polymorph
