// Fewer triangles, where they say little.
#pragma once

#include "base/result.h"
#include "interchange/surface_frame.h"

namespace polymorph {

/// Collapses edges (meshoptimizer's simplification, after Garland and Heckbert 1997) as long as the
/// Hausdorff distance between both surfaces, as samples show it, is at most `distance`, > 0. What
/// is left of the points keeps its place and all that it carries; seams of textures and borders of
/// materials stay. Returns that distance.
float simplify(SurfaceFrame& frame, float distance);

}  // namespace polymorph
