// Judgements on changed colours, from the colours alone.
#pragma once

#include <string>

#include "compare/image_pair.h"

namespace polymorph {

/// Names the curve that all colours follow: brightness or gamma; "" where there is none.
std::string explain_curve(const ImagePair& pair);

/// Tests whether no code of 8 bits differs by more than one step.
bool only_rounding(const ImagePair& pair);

/// Tests whether the differences cancel over blocks of pixels.
bool only_noise(const ImagePair& pair);

/// Tests whether the edges of the colours stay in place. Nearly all pixels with a strong gradient
/// in one image must have a gradient in the other.
bool edges_stay(const ImagePair& pair);

/// Names the part of the picture in which all changed pixels lie; "" where it is no small part.
std::string explain_part(const ImagePair& pair);

}  // namespace polymorph
