// Coverages of pixels, as integer formats have them.
#pragma once

#include <algorithm>

namespace polymorph {

/// Clamps an alpha to [0, 1]. NaN, which files may hold, covers nothing.
inline float clamp_coverage(float alpha) { return alpha > 0 ? std::min(alpha, 1.0f) : 0.0f; }

}  // namespace polymorph
