// Differences of header entries that change how equal pixels are shown.
#pragma once

#include <string>

#include "image/image.h"

namespace polymorph {

/// Names the entries (pixel aspect ratio, orientation, gamma, ICC profile, colour space) that
/// differ, or "".
std::string describe_display_mismatch(const Image& actual, const Image& reference);

}  // namespace polymorph
