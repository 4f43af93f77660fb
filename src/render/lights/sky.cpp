#include "render/lights/sky.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/result.h"
#include "image/rgb_channels.h"
#include "kernels/simd_math.h"
#include "render/math/vector_math.h"

namespace polymorph {
namespace {

constexpr int kCoarseWidth = 128, kCoarseHeight = 64;  // cells of the irradiance integral
constexpr int kMaxDistributionWidth = 2048;  // cells per row of the pdf of the bright part
// Radiance of an image above this multiple of its mean luminance belongs to the bright part. Clouds
// and windows are usually below it.
constexpr float kCalmMultiple = 4;

/// Inverts lat_long().
Vec3 from_lat_long(float u, float v) {
  const Vec2 azimuth = cos_sin_turns(u - 0.5f), polar = cos_sin_turns(0.5f * v);
  return {azimuth.y * polar.y, polar.x, -azimuth.x * polar.y};
}

/// Solid angle of a cell in row y of a lat-long grid of `width` x `height` cells.
float cell_solid_angle(int y, int width, int height) {
  const float top = cosine(kPi * static_cast<float>(y) / static_cast<float>(height));
  const float bottom = cosine(kPi * static_cast<float>(y + 1) / static_cast<float>(height));
  return 2 * kPi / static_cast<float>(width) * (top - bottom);
}

/// Computes the mean of f(direction) over each cell of a lat-long grid of `width` x `height` cells.
/// It takes at least one sample per texel of the sky, up to 64 x 64 per cell.
template <class F>
auto compute_cell_means(const Sky& sky, int width, int height, const F& f) {
  using Value = decltype(f(Vec3{}));
  std::vector<Value> cells(static_cast<std::size_t>(width) * height);
  const int taps = std::clamp(sky.width / width + 1, 2, 64);
  // Coordinate of a tap of a cell along an axis of `count` cells, [0, 1].
  const auto position = [&](std::int64_t cell, int tap, int count) {
    return (static_cast<float>(cell) +
            (static_cast<float>(tap) + 0.5f) / static_cast<float>(taps)) /
           static_cast<float>(count);
  };
  parallel_for(height, [&](std::int64_t y) {
    for (int x = 0; x < width; ++x) {
      Value sum{};
      for (int i = 0; i < taps * taps; ++i)
        sum = sum + f(from_lat_long(position(x, i % taps, width), position(y, i / taps, height)));
      cells[static_cast<std::size_t>(y) * width + x] = sum / static_cast<float>(taps * taps);
    }
  });
  return cells;
}

/// Makes the distribution of the bright part's luminance.
SkyDistribution make_distribution(const Sky& sky, SkyDomain domain) {
  SkyDistribution d;
  // One cell per texel, because with coarser cells most samples would miss a sun of half a degree.
  d.width = std::min(sky.width, kMaxDistributionWidth);
  d.height = std::min(sky.height, kMaxDistributionWidth / 2);
  const std::vector<float> cells = compute_cell_means(sky, d.width, d.height, [&](Vec3 direction) {
    return luminance(split_radiance(sky, sky_radiance(sky, direction)).bright);
  });
  const int rows = domain == SkyDomain::kAboveHorizon ? (d.height + 1) / 2 : d.height;
  d.row_cdf.assign(static_cast<std::size_t>(d.height) + 1, 0);
  d.column_cdf.assign(static_cast<std::size_t>(d.height) * (d.width + 1), 0);
  d.pdf.assign(static_cast<std::size_t>(d.height) * d.width, 0);
  // The CDF of the columns of each row.
  double total = 0;
  std::vector<double> row_sum(static_cast<std::size_t>(d.height), 0.0);
  for (int y = 0; y < rows; ++y) {
    const double solid_angle = cell_solid_angle(y, d.width, d.height);
    float* cdf = &d.column_cdf[static_cast<std::size_t>(y) * (d.width + 1)];
    double sum = 0;
    for (int x = 0; x < d.width; ++x) {
      sum += cells[static_cast<std::size_t>(y) * d.width + x] * solid_angle;
      cdf[x + 1] = static_cast<float>(sum);
    }
    for (int x = 1; x <= d.width; ++x) cdf[x] = sum > 0 ? static_cast<float>(cdf[x] / sum) : 0.0f;
    row_sum[y] = sum;
    total += sum;
  }
  d.total = static_cast<float>(total);
  if (!(total > 0)) return d;
  // The CDF of the rows, and the pdf.
  double cumulative = 0;
  for (int y = 0; y < d.height; ++y) {
    cumulative += row_sum[y];
    d.row_cdf[static_cast<std::size_t>(y) + 1] = static_cast<float>(cumulative / total);
    if (y >= rows) continue;
    for (int x = 0; x < d.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * d.width + x;
      d.pdf[i] = static_cast<float>(cells[i] / total);
    }
  }
  return d;
}

/// Inverts encode_octahedral().
Vec3 decode_octahedral(float x, float y) {
  Vec3 d{x, 1 - std::fabs(x) - std::fabs(y), y};
  if (d.y < 0) {
    d.x = std::copysign(1 - std::fabs(y), x);
    d.z = std::copysign(1 - std::fabs(x), y);
  }
  return normalized(d);
}
/// Tabulates the irradiance of the calm part: for eight normals at a time, sums the light of all
/// cells of a coarse lat-long grid.
std::vector<Vec3> make_irradiance(const Sky& sky) {
  const std::vector<Vec3> cells = compute_cell_means(
      sky, kCoarseWidth, kCoarseHeight,
      [&](Vec3 direction) { return split_radiance(sky, sky_radiance(sky, direction)).calm; });
  struct Source {
    Vec3 direction, power;  // power: radiance times solid angle
    float solid_angle;
  };
  std::vector<Source> sources;
  for (int y = 0; y < kCoarseHeight; ++y) {
    const float solid_angle = cell_solid_angle(y, kCoarseWidth, kCoarseHeight);
    for (int x = 0; x < kCoarseWidth; ++x)
      sources.push_back({from_lat_long((static_cast<float>(x) + 0.5f) / kCoarseWidth,
                                       (static_cast<float>(y) + 0.5f) / kCoarseHeight),
                         cells[static_cast<std::size_t>(y) * kCoarseWidth + x] * solid_angle,
                         solid_angle});
  }
  constexpr int kNodes = kIrradianceCells + 1;
  std::vector<Vec3> nodes(kNodes * kNodes);
  constexpr int kCount = kNodes * kNodes;
  parallel_for((kCount + kLanes - 1) / kLanes, [&](std::int64_t pack) {
    const auto coordinate = [](int k) { return 2 * static_cast<float>(k) / kIrradianceCells - 1; };
    alignas(32) float x[kLanes], y[kLanes], z[kLanes];
    const int first = static_cast<int>(pack) * kLanes;
    for (int l = 0; l < kLanes; ++l) {
      const int i = std::min(first + l, kCount - 1);
      const Vec3 normal = decode_octahedral(coordinate(i % kNodes), coordinate(i / kNodes));
      x[l] = normal.x, y[l] = normal.y, z[l] = normal.z;
    }
    const Pack nx = Lanes<Pack>::load(x), ny = Lanes<Pack>::load(y), nz = Lanes<Pack>::load(z);
    Pack r{}, g{}, b{}, cosines{};
    for (const Source& source : sources) {
      const Vec3 d = source.direction;
      const Pack cosine = max(nx * d.x + ny * d.y + nz * d.z, broadcast<Pack>(0.0f));
      r = r + cosine * source.power.x;
      g = g + cosine * source.power.y;
      b = b + cosine * source.power.z;
      cosines = cosines + cosine * source.solid_angle;
    }
    for (int l = 0; l < kLanes && first + l < kCount; ++l)
      // Dividing by the sum of cosines makes the irradiance of a constant sky exact.
      nodes[static_cast<std::size_t>(first + l)] = Vec3{r[l], g[l], b[l]} * (kPi / cosines[l]);
  });
  return nodes;
}

float mean_luminance(const Sky& sky) {
  double sum = 0;
  for (int y = 0; y < sky.height; ++y) {
    double row = 0;
    for (int x = 0; x < sky.width; ++x)
      row += luminance(sky.texels[static_cast<std::size_t>(y) * sky.width + x]);
    sum += row * cell_solid_angle(y, sky.width, sky.height);
  }
  return static_cast<float>(sum / (4 * std::numbers::pi));
}

/// Computes the irradiance of a floor by the calm part of the upper half.
Vec3 integrate_upper(const Sky& sky) {
  constexpr int kWidth = 256, kHeight = 64;  // over the upper half only
  const auto direction = [](std::int64_t x, std::int64_t y) {
    return from_lat_long((static_cast<float>(x) + 0.5f) / kWidth,
                         (static_cast<float>(y) + 0.5f) / (2 * kHeight));
  };
  std::vector<Vec3> radiance(std::size_t{kWidth} * kHeight);
  parallel_for(kHeight, [&](std::int64_t y) {
    for (int x = 0; x < kWidth; ++x)
      radiance[static_cast<std::size_t>(y) * kWidth + x] =
          split_radiance(sky, sky_radiance(sky, direction(x, y))).calm;
  });
  double r = 0, g = 0, b = 0, cosines = 0;
  for (int y = 0; y < kHeight; ++y) {
    const double solid_angle = cell_solid_angle(y, kWidth, 2 * kHeight);
    for (int x = 0; x < kWidth; ++x) {
      const Vec3 incoming = radiance[static_cast<std::size_t>(y) * kWidth + x];
      const double weight = solid_angle * direction(x, y).y;
      r += weight * incoming.x;
      g += weight * incoming.y;
      b += weight * incoming.z;
      cosines += weight;
    }
  }
  // As in make_irradiance(), this makes the irradiance of a constant sky exact.
  return Vec3{static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)} *
         static_cast<float>(static_cast<double>(kPi) / cosines);
}

}  // namespace

void prepare_sky(Sky& sky, SkyDomain domain) {
  PM_CHECK(sky.width >= 1 && sky.height >= 1);
  PM_CHECK(sky.texels.size() == static_cast<std::size_t>(sky.width) * sky.height);
  sky.has_bright = std::any_of(sky.texels.begin(), sky.texels.end(),
                               [&](Vec3 texel) { return luminance(texel) > sky.calm_level; });
  if (sky.has_bright) sky.distribution = make_distribution(sky, domain);
  sky.irradiance = make_irradiance(sky);
  sky.upper_irradiance = integrate_upper(sky);
}

Sky make_image_sky(const Image& image, float scale, SkyDomain domain) {
  PM_CHECK(image.width >= 1 && image.height >= 1 && image.channel_count() >= 1);
  std::array<int, 3> channel = find_rgb(image);
  for (int& c : channel) c = std::max(c, 0);  // a missing channel takes the first one
  const auto scale_or_zero = [&](float value) {
    return std::isfinite(value) && value > 0 ? value * scale : 0.0f;
  };
  Sky sky;
  sky.width = image.width;
  sky.height = image.height;
  sky.texels.resize(static_cast<std::size_t>(sky.width) * sky.height);
  for (int y = 0; y < sky.height; ++y)
    for (int x = 0; x < sky.width; ++x)
      sky.texels[static_cast<std::size_t>(y) * sky.width + x] = {
          scale_or_zero(image.at(x, y, channel[0])), scale_or_zero(image.at(x, y, channel[1])),
          scale_or_zero(image.at(x, y, channel[2]))};
  sky.calm_level = kCalmMultiple * mean_luminance(sky);
  prepare_sky(sky, domain);
  return sky;
}

Vec3 sky_direction(const Sky& sky, float x, float y) {
  return from_lat_long(x / static_cast<float>(sky.width), y / static_cast<float>(sky.height));
}

SkyTables::SkyTables(const Sky& sky)
    : width(sky.width),
      height(sky.height),
      texels(sky.texels.data()),
      calm_level(sky.calm_level),
      has_bright(sky.has_bright),
      columns(sky.distribution.width),
      rows(sky.distribution.height),
      row_cdf(sky.distribution.row_cdf.data()),
      column_cdf(sky.distribution.column_cdf.data()),
      pdf(sky.distribution.pdf.data()),
      irradiance(sky.irradiance.data()),
      upper_irradiance(sky.upper_irradiance) {}

template Pack3 sky_radiance(const SkyTables&, const Pack3&);
template Pack bright_sky_pdf(const SkyTables&, const Pack3&);
template Pack3 sky_irradiance(const SkyTables&, const Pack3&);

}  // namespace polymorph
