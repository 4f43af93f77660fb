// Mesh simplification with a bounded Hausdorff distance.
#pragma once

#include "interchange/surface_frame.h"

namespace polymorph {

/// Collapses edges (meshoptimizer's simplification, after Garland and Heckbert 1997) as long as the
/// Hausdorff distance between the old and the new surface, measured at samples, is at most
/// `distance` (> 0, scene units). The remaining points keep their positions and attributes; seams
/// of textures and borders of materials stay. Returns the measured distance; 0 if the frame is
/// unchanged.
float simplify(SurfaceFrame& frame, float distance);

}  // namespace polymorph
