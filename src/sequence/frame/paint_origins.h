// Paint that shows what becomes what through a film.
#pragma once

#include "base/result.h"
#include "kernels/engine.h"
#include "sequence/frame/frame_geometry.h"

namespace polymorph {

/// Paints what a frame shows of each actor: every point gets the colour of the place on the actor's
/// first object that it comes from (leg/origin_colors.h). Errors: the engine's.
Status paint_origins(const PreparedScene& prepared, Engine& engine, FrameGeometry& geometry);

}  // namespace polymorph
