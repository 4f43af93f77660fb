// Flicker: change from frame to frame where nothing moves.
#pragma once

#include <cstddef>
#include <optional>

#include "image/image.h"

namespace polymorph {

struct Flicker {
  double mean = 0;  ///< mean |difference| of R, G, B in sRGB (0 to 1) over the counted pixels
  std::size_t pixels = 0;  ///< number of pixels that show the same object, unmoved, in both frames
};

/// Measures flicker between neighbouring frames over the pixels of equal id and zero motion. A
/// layer that is missing excludes no pixels. Returns nullopt if the sizes differ, if a colour
/// channel is missing, or if no pixel is left.
std::optional<Flicker> flicker_between(const Image& frame, const Image& next);

}  // namespace polymorph
