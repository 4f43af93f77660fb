// Causes of changed colours, judged by the colours alone.
#pragma once

#include <string>

#include "compare/image_pair.h"

namespace polymorph {

/// Describes the curve that maps all old colours to new ones: brightness or gamma; "" if none does.
std::string explain_curve(const ImagePair& pair);

/// Tests whether 8-bit codes differ by at most one step, upwards as often as downwards.
bool is_only_rounding(const ImagePair& pair);

/// Tests whether the differences cancel over blocks of pixels.
bool is_only_noise(const ImagePair& pair);

/// Tests whether the edges of the colours stay in place. Nearly all pixels with a strong gradient
/// in one image must have a gradient in the other.
bool edges_stay(const ImagePair& pair);

/// Describes the rectangle that contains all changed pixels; "" if it exceeds 1/8 of the picture.
std::string explain_region(const ImagePair& pair);

}  // namespace polymorph
