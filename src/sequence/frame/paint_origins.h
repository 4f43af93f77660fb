// Paint that shows, throughout a film, which point of an object becomes which point of the other
// objects.
#pragma once

#include "base/result.h"
#include "kernels/engine.h"
#include "sequence/frame/frame_geometry.h"

namespace polymorph {

/// Paints each actor's geometry: every point gets the colour of the point on the actor's first
/// object that it comes from (leg/origin_colors.h). Errors: the engine's.
Status paint_origins(const PreparedScene& prepared, Engine& engine, FrameGeometry& geometry);

}  // namespace polymorph
