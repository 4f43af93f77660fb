// Colour spaces of EXR files: linear Rec. 709, in which everything here computes, and ACEScg.
#pragma once

#include <cstdint>
#include <string>

#include "image/image.h"

namespace polymorph {

enum class ColorSpace : std::uint8_t {
  kRec709,  ///< linear, primaries of Rec. 709 and sRGB, white D65
  kAcesCg,  ///< linear, primaries AP1, white of ACES (Academy S-2014-004)
};

/// Header entries by which a file names the space of its colours.
struct ColorSpaceLabel {
  const char* interop_id;   ///< kColorInteropAttribute
  float chromaticities[8];  ///< x, y of red, green, blue and white
};
const ColorSpaceLabel& color_space_label(ColorSpace space);

/// The name of the space that an image's numbers are in, by its attributes: kColorInteropAttribute
/// or, without it, what the primaries say: "lin_rec709_scene", "lin_ap1_scene" or the primaries
/// themselves. An image that says nothing is in Rec. 709.
std::string color_space_name(const Image& image);

/// Tests whether a layer has colours: channels LAYER.R, LAYER.G and LAYER.B, or R, G and B where
/// `layer` is empty, that are no Cryptomatte's.
bool is_color_layer(const Image& image, const std::string& layer);

/// Converts the colours of an image in Rec. 709 to `space`: R, G, B and every other layer that
/// has colours. Depths, normals, ids and alpha stay. Greys stay
/// within rounding, and the result is the same bits on every machine. Attributes stay.
void convert_colors(Image& image, ColorSpace space);

/// Converts the colours of an image that is in ACEScg by its attributes to Rec. 709, and removes
/// those attributes; every other image stays as it is.
void convert_to_rec709(Image& image);

}  // namespace polymorph
