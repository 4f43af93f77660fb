// Mesh simplification with a bounded Hausdorff distance.
#pragma once

#include "base/result.h"
#include "interchange/surface_frame.h"

namespace polymorph {

/// Collapses edges (meshoptimizer's simplification, after Garland and Heckbert 1997) as long as the
/// Hausdorff distance between both surfaces, measured at samples, is at most `distance`, > 0. The
/// remaining points keep their positions and attributes; seams of textures and borders of materials
/// stay. Returns the distance that was reached; 0 if the frame did not change.
float simplify(SurfaceFrame& frame, float distance);

}  // namespace polymorph
