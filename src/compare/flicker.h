// Flicker: change from frame to frame where nothing moves.
#pragma once

#include <cstddef>
#include <optional>

#include "image/image.h"

namespace polymorph {

struct Flicker {
  double mean = 0;         ///< mean |difference| of R, G, B in sRGB over `pixels`
  std::size_t pixels = 0;  ///< pixels that show the same object in both frames and stand still
};

/// Measures flicker between neighbouring frames over the pixels of equal id and zero motion, if the
/// images have these layers. Returns nullopt if the sizes differ, if a colour channel is missing,
/// or if no pixel stands still.
std::optional<Flicker> flicker_between(const Image& frame, const Image& next);

}  // namespace polymorph
