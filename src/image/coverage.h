// Conversion of alpha to the coverage [0, 1] that integer formats store.
#pragma once

#include <algorithm>

namespace polymorph {

/// Clamps an alpha to [0, 1]. NaN, which files may contain, becomes 0.
inline float clamp_coverage(float alpha) { return alpha > 0 ? std::min(alpha, 1.0f) : 0.0f; }

}  // namespace polymorph
