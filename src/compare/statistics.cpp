#include "compare/statistics.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace polymorph {
namespace {

/// R, G, B of an image, clamped; tiles are the means of a grid of tiles.
struct Values {
  int width = 0, height = 0;
  std::vector<double> rgb;
  bool finite = true;
};

Values values_of(const Image& image, float brightest) {
  Values values{image.width, image.height, {}, true};
  const int channels[] = {image.find_channel("R"), image.find_channel("G"),
                          image.find_channel("B")};
  const std::size_t pixels =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  values.rgb.reserve(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    for (const int channel : channels) {
      const float value =
          image.pixels[i * image.channel_count() + static_cast<std::size_t>(channel)];
      values.finite = values.finite && std::isfinite(value);
      values.rgb.push_back(static_cast<double>(std::min(value, brightest)));
    }
  return values;
}

Values tiles_of(const Values& values, int side) {
  Values tiles{(values.width + side - 1) / side, (values.height + side - 1) / side, {}, true};
  const std::size_t count = static_cast<std::size_t>(tiles.width * tiles.height);
  tiles.rgb.resize(3 * count);
  std::vector<double> pixels(count);
  for (int y = 0; y < values.height; ++y)
    for (int x = 0; x < values.width; ++x) {
      const auto tile = static_cast<std::size_t>(y / side * tiles.width + x / side);
      const auto pixel = static_cast<std::size_t>(y * values.width + x);
      ++pixels[tile];
      for (std::size_t c = 0; c < 3; ++c) tiles.rgb[3 * tile + c] += values.rgb[3 * pixel + c];
    }
  for (std::size_t i = 0; i < tiles.rgb.size(); ++i) tiles.rgb[i] /= pixels[i / 3];
  return tiles;
}

/// How many standard deviations of a normal distribution are as rare as `t` with `freedom` degrees
/// of freedom (Wallace 1959, within 0.2 %).
double normal_of_t(double t, double freedom) {
  return (8 * freedom + 1) / (8 * freedom + 3) * std::sqrt(freedom * std::log1p(t * t / freedom));
}

/// The z of each value of the reference among those of the runs.
std::vector<double> z_values(const std::vector<Values>& runs, const Values& reference,
                             double reference_share, double min_error) {
  const auto count = static_cast<double>(runs.size());
  std::vector<double> z(reference.rgb.size());
  for (std::size_t i = 0; i < z.size(); ++i) {
    double mean = 0, squares = 0;
    for (const Values& run : runs) mean += run.rgb[i] / count;
    for (const Values& run : runs) squares += (run.rgb[i] - mean) * (run.rgb[i] - mean);
    const double variance = squares / (count - 1);
    const double smallest = min_error * (1 + std::abs(mean));
    const double error = std::sqrt(variance * (1 / count + reference_share) + smallest * smallest);
    z[i] = normal_of_t((reference.rgb[i] - mean) / error, count - 1);
  }
  return z;
}

/// A z beyond which one of `tests` lies by chance, as often as `significance` says.
bool too_rare(double z, double significance, std::size_t tests) {
  const double each = -std::expm1(std::log1p(-significance) / static_cast<double>(tests));
  return std::erfc(z / std::sqrt(2.0)) < each;
}

}  // namespace

Result<StatisticsResult> compare_statistics(std::span<const Image> runs, int run_samples,
                                            const Image& reference, int reference_samples,
                                            const StatisticsSettings& settings) {
  PM_CHECK(runs.size() >= 4 && run_samples > 0 && reference_samples > 0 && settings.tile > 0);
  const auto usable = [&](const Image& image) {
    return image.width == reference.width && image.height == reference.height && image.width > 0 &&
           image.height > 0 && image.find_channel("R") >= 0 && image.find_channel("G") >= 0 &&
           image.find_channel("B") >= 0;
  };
  for (const Image& run : runs)
    if (!usable(run) || !usable(reference))
      return make_error(ErrorCode::kInput,
                        "images of one size with R, G and B are needed: {} x {} and {} x {}",
                        run.width, run.height, reference.width, reference.height);
  StatisticsResult result;
  const Values expected = values_of(reference, settings.brightest);
  std::vector<Values> pixels, tiles;
  bool finite = expected.finite;
  for (const Image& run : runs) {
    pixels.push_back(values_of(run, settings.brightest));
    tiles.push_back(tiles_of(pixels.back(), settings.tile));
    finite = finite && pixels.back().finite;
  }
  if (!finite) {
    result.reason = "there are NaN or infinite pixels";
    return result;
  }
  const double share = static_cast<double>(run_samples) / reference_samples;
  const auto pixel_z = z_values(pixels, expected, share, settings.min_error);
  const Values expected_tiles = tiles_of(expected, settings.tile);
  const auto tile_z = z_values(tiles, expected_tiles, share, settings.min_error);
  std::size_t good = 0;
  for (std::size_t i = 0; i < pixel_z.size(); i += 3)
    good += !too_rare(std::max({pixel_z[i], pixel_z[i + 1], pixel_z[i + 2]}), settings.significance,
                      pixel_z.size());
  result.pixels_passing =
      100.0 * static_cast<double>(good) / (static_cast<double>(pixel_z.size()) / 3);
  result.tiles = static_cast<int>(tile_z.size() / 3);
  for (std::size_t i = 0; i < tile_z.size(); i += 3) {
    const double z = std::max({tile_z[i], tile_z[i + 1], tile_z[i + 2]});
    result.failing_tiles += too_rare(z, settings.significance, tile_z.size());
    if (z <= result.worst_z) continue;
    result.worst_z = z;
    result.worst_x = static_cast<int>(i / 3) % expected_tiles.width * settings.tile;
    result.worst_y = static_cast<int>(i / 3) / expected_tiles.width * settings.tile;
  }
  const double tiles_passing =
      100.0 * (result.tiles - result.failing_tiles) / static_cast<double>(result.tiles);
  result.passed =
      tiles_passing >= settings.tiles_percent && result.pixels_passing >= settings.pixels_percent;
  result.reason = fmt::format(
      "{:.2f} % of the pixels and {} of {} tiles agree but for noise; the worst tile, at ({}, {}), "
      "is off by {:.1f} standard deviations",
      result.pixels_passing, result.tiles - result.failing_tiles, result.tiles, result.worst_x,
      result.worst_y, result.worst_z);
  return result;
}

}  // namespace polymorph
