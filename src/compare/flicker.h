// Flicker: change from frame to frame where nothing moves.
#pragma once

#include <cstddef>
#include <optional>

#include "image/image.h"

namespace polymorph {

struct Flicker {
  double mean = 0;         ///< |difference| of R, G, B, as sRGB encodes them, over those pixels
  std::size_t pixels = 0;  ///< pixels that show the same object in both frames and stand still
};

/// Between neighbouring frames; pixels count whose id is the same and whose motion is 0, where the
/// images have these layers. Nothing for images of different sizes, without colours, or where no
/// pixel stands still.
std::optional<Flicker> flicker_between(const Image& frame, const Image& next);

}  // namespace polymorph
