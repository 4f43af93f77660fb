// Differences of header entries that change how equal pixels are shown.
#pragma once

#include <string>

#include "image/image.h"

namespace polymorph {

/// Lists the entries (pixel aspect ratio, orientation, gamma, ICC profile, colour space) that
/// differ, with both values; "" if none does.
std::string describe_display_mismatch(const Image& actual, const Image& reference);

}  // namespace polymorph
