#include "image/color_space.h"

#include <array>
#include <optional>
#include <vector>

#include "base/parallel.h"
#include "base/text.h"
#include "image/attributes.h"
#include "image/color_description.h"
#include "image/image_io.h"

namespace polymorph {
namespace {

/// Labels in the order of ColorSpace.
constexpr ColorSpaceLabel kLabels[] = {
    {"lin_rec709_scene", {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f}},
    {"lin_ap1_scene", {0.713f, 0.293f, 0.165f, 0.830f, 0.128f, 0.044f, 0.32168f, 0.33767f}}};

using Matrix = std::array<std::array<float, 3>, 3>;

// The primaries of kLabels give the matrices to XYZ (SMPTE RP 177); D65 is adapted to the white of
// ACES, and back, by Bradford's transform (Lam 1985; rows 0.8951 0.2664 -0.1614, -0.7502 1.7135
// 0.0367, 0.0389 -0.0685 1.0296). The matrices were computed with fractions and rounded to float.
// They equal those of OpenColorIO's built-in transform "UTILITY - ACES-AP1_to_LINEAR-REC709_BFD",
// forwards and backwards. Their rows add up to 1 as floats too, so that greys do not change.
constexpr Matrix kRec709ToAcesCg{{{0.613097402f, 0.339523146f, 0.0473794514f},
                                  {0.0701937225f, 0.916353879f, 0.0134523985f},
                                  {0.0206155929f, 0.109569773f, 0.869814634f}}};
constexpr Matrix kAcesCgToRec709{{{1.70505099f, -0.621792121f, -0.083258872f},
                                  {-0.130256418f, 1.14080474f, -0.0105483191f},
                                  {-0.0240033568f, -0.128968976f, 1.15297233f}}};

using Channels = std::array<std::size_t, 3>;

/// Finds the channels named `prefix` followed by R, G and B; nullopt if one is missing or if the
/// layer belongs to a Cryptomatte.
std::optional<Channels> find_colors(const Image& image, const std::string& prefix) {
  // The channels R, G and B of a Cryptomatte hold ids and coverages.
  if (lower_case(prefix).find("crypto") != std::string::npos) return std::nullopt;
  const int red = image.find_channel(prefix + "R"), green = image.find_channel(prefix + "G"),
            blue = image.find_channel(prefix + "B");
  if (red < 0 || green < 0 || blue < 0) return std::nullopt;
  return Channels{static_cast<std::size_t>(red), static_cast<std::size_t>(green),
                  static_cast<std::size_t>(blue)};
}

/// Lists the colour channels of every layer that has colours.
std::vector<Channels> find_color_layers(const Image& image) {
  std::vector<Channels> layers;
  for (const std::string& name : image.channels) {
    if (name != "R" && !name.ends_with(".R")) continue;
    if (const auto colors = find_colors(image, name.substr(0, name.size() - 1)))
      layers.push_back(*colors);
  }
  return layers;
}

/// Multiplies the colours (r, g, b) of all layers by a matrix.
void multiply_colors(const Matrix& m, Image& image) {
  const std::vector<Channels> layers = find_color_layers(image);
  const std::size_t count = image.channel_count();
  parallel_for(
      image.height,
      [&](std::int64_t y) {
        const auto width = static_cast<std::size_t>(image.width);
        float* pixel = image.pixels.data() + static_cast<std::size_t>(y) * width * count;
        for (std::size_t x = 0; x < width; ++x, pixel += count)
          for (const Channels& layer : layers) {
            const float r = pixel[layer[0]], g = pixel[layer[1]], b = pixel[layer[2]];
            for (std::size_t c = 0; c < 3; ++c)
              pixel[layer[c]] = (m[c][0] * r + m[c][1] * g) + m[c][2] * b;
          }
      },
      /*grain=*/16);
}

}  // namespace

const ColorSpaceLabel& color_space_label(ColorSpace space) {
  return kLabels[static_cast<std::size_t>(space)];
}

std::string color_space_name(const Image& image) {
  if (std::string id = find_text(image, kColorInteropAttribute); !id.empty()) return id;
  std::string primaries = find_text(image, kColorPrimariesAttribute);
  if (primaries.empty()) return color_space_label(ColorSpace::kRec709).interop_id;
  const ColorSpaceLabel& acescg = color_space_label(ColorSpace::kAcesCg);
  return primaries == describe_primaries(acescg.chromaticities) ? acescg.interop_id : primaries;
}

bool is_color_layer(const Image& image, const std::string& layer) {
  return find_colors(image, layer.empty() ? layer : layer + ".").has_value();
}

void convert_colors(Image& image, ColorSpace space) {
  if (space == ColorSpace::kAcesCg) multiply_colors(kRec709ToAcesCg, image);
}

void convert_to_rec709(Image& image) {
  if (color_space_name(image) != color_space_label(ColorSpace::kAcesCg).interop_id) return;
  multiply_colors(kAcesCgToRec709, image);
  std::erase_if(image.attributes, [](const Attribute& attribute) {
    return attribute.name == kColorInteropAttribute || attribute.name == kColorPrimariesAttribute;
  });
}

}  // namespace polymorph
