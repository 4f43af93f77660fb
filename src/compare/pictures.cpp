#include "compare/pictures.h"

#include <algorithm>
#include <array>

#include "image/color_space.h"
#include "image/srgb.h"
#include "image/strip.h"

namespace polymorph {
namespace {

using Color = std::array<float, 3>;

/// sRGB codes at 0, 1/8, ... 1. Lightness rises evenly, so that the map is readable in grey, too.
constexpr int kHeatColors[][3] = {{3, 3, 10},     {35, 17, 82},    {89, 24, 122},
                                  {143, 42, 126}, {198, 60, 111},  {236, 96, 88},
                                  {251, 147, 98}, {253, 199, 137}, {252, 249, 196}};

/// Interpolates kHeatColors (in sRGB) at a value of 0 to 1. Returns a linear colour.
Color heat_color(float value) {
  constexpr int kSteps = static_cast<int>(std::size(kHeatColors)) - 1;
  const float position = std::clamp(value, 0.0f, 1.0f) * kSteps;
  const int step = std::min(static_cast<int>(position), kSteps - 1);
  const float fraction = position - static_cast<float>(step);
  Color color;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto low = static_cast<float>(kHeatColors[step][c]);
    const auto high = static_cast<float>(kHeatColors[step + 1][c]);
    color[c] = srgb_to_linear((low + fraction * (high - low)) / 255);
  }
  return color;
}

std::size_t pixel_count(int width, int height) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

/// Repeats each pixel as a square of `scale` x `scale` pixels.
Image enlarge(const Image& image, int scale) {
  Image large = make_image(image.width * scale, image.height * scale, image.channels);
  for (int y = 0; y < large.height; ++y)
    for (int x = 0; x < large.width; ++x)
      for (int c = 0; c < static_cast<int>(image.channel_count()); ++c)
        large.at(x, y, c) = image.at(x / scale, y / scale, c);
  return large;
}

}  // namespace

Image visible_colors(const Image& image) {
  Image shown = make_image(image.width, image.height, {"R", "G", "B"});
  shown.attributes = image.attributes;  // they contain the colour space
  if (image.channels.empty()) return shown;
  std::size_t source[3];
  for (std::size_t c = 0; c < 3; ++c)
    // find_channel() is -1 for a missing channel, in whose place the first one is shown.
    source[c] = static_cast<std::size_t>(std::max(image.find_channel(shown.channels[c]), 0));
  for (std::size_t i = 0; i < pixel_count(image.width, image.height); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      shown.pixels[3 * i + c] = image.pixels[i * image.channel_count() + source[c]];
  convert_to_rec709(shown);
  shown.attributes.clear();
  return shown;
}

Image heat_picture(const std::vector<float>& map, int width, int height, double range) {
  const auto scale = static_cast<float>(1 / range);
  PM_CHECK(map.size() == pixel_count(width, height));
  Image picture = make_image(width, height, {"R", "G", "B"});
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Color color = heat_color(scale * map[i]);
    std::copy(color.begin(), color.end(), &picture.pixels[3 * i]);
  }
  return picture;
}

double heat_range(double max) {
  double range = 1;
  for (const double smaller : {0.5, 0.2, 0.1, 0.05, 0.02, 0.01})
    if (max <= smaller) range = smaller;
  return range;
}

Image limits_picture(const Image& reference, const std::vector<PixelState>& states) {
  PM_CHECK(states.size() == pixel_count(reference.width, reference.height));
  Image picture = visible_colors(reference);
  for (std::size_t i = 0; i < states.size(); ++i) {
    float* rgb = &picture.pixels[3 * i];
    const float luminance = 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2];  // Rec. 709
    const float grey = 0.12f * (luminance > 0 ? std::min(luminance, 1.0f) : 0.0f);
    Color color{grey, grey, grey};
    if (states[i] == PixelState::kOver) color = {0.9f, 0.04f, 0.03f};
    if (states[i] == PixelState::kHard) color = {1, 0.8f, 0.05f};
    if (states[i] == PixelState::kNotFinite) color = {0, 0.9f, 1};
    std::copy(color.begin(), color.end(), rgb);
  }
  return picture;
}

Result<Image> failure_picture(const Image& actual, const Image& reference,
                              const Comparison& comparison, const PixelMaps& maps) {
  if (maps.states.empty()) return difference_triptych(actual, reference);
  Image third_picture = limits_picture(reference, maps.states);
  std::string caption = fmt::format("{} pixels over the limits", comparison.failing_pixels);
  if (comparison.flip && !maps.flip.empty()) {
    const double range = heat_range(comparison.flip->max);
    third_picture = heat_picture(maps.flip, reference.width, reference.height, range);
    caption = fmt::format("FLIP {:.4f}, shown 0 to {:g}", comparison.flip->mean, range);
  }
  const int scale = std::max(1, 320 / reference.width);
  const Image frames[] = {enlarge(visible_colors(reference), scale),
                          enlarge(visible_colors(actual), scale), enlarge(third_picture, scale)};
  const std::string captions[] = {"reference", "new", caption};
  return make_strip(frames, captions, {.columns = 3});
}

}  // namespace polymorph
