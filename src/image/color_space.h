// Colour spaces of EXR files: linear Rec. 709, in which the program computes, and ACEScg.
#pragma once

#include <cstdint>
#include <string>

#include "image/image.h"

namespace polymorph {

enum class ColorSpace : std::uint8_t {
  kRec709,  ///< linear, primaries of Rec. 709 and sRGB, white D65
  kAcesCg,  ///< linear, primaries AP1, white of ACES (Academy S-2014-004)
};

/// Header entries that state the colour space of a file.
struct ColorSpaceLabel {
  const char* interop_id;   ///< kColorInteropAttribute
  float chromaticities[8];  ///< x, y of red, green, blue and white
};
const ColorSpaceLabel& color_space_label(ColorSpace space);

/// Returns the name of an image's colour space: the value of kColorInteropAttribute or, without
/// this attribute, the name of the space with the image's primaries: "lin_rec709_scene",
/// "lin_ap1_scene" or the primaries themselves. An image without these attributes is in Rec. 709.
std::string color_space_name(const Image& image);

/// Tests whether a layer has colours: channels LAYER.R, LAYER.G and LAYER.B (R, G and B if `layer`
/// is empty) that do not belong to a Cryptomatte.
bool is_color_layer(const Image& image, const std::string& layer);

/// Converts the colours of an image in Rec. 709 to `space`: R, G, B and every other layer that has
/// colours. Depths, normals, ids, alpha and attributes do not change. Greys change only by
/// rounding. The result has the same bits on every machine.
void convert_colors(Image& image, ColorSpace space);

/// Converts an image whose attributes say ACEScg to Rec. 709, and removes these attributes. Does
/// not change any other image.
void convert_to_rec709(Image& image);

}  // namespace polymorph
