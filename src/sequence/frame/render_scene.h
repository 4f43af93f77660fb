// Render scene of a frame: the input of the renderer.
#pragma once

#include "render/render.h"
#include "sequence/frame/frame_geometry.h"

namespace polymorph {

/// Collects the meshes, camera and lights of one frame; the result borrows from both arguments. The
/// ids in the id AOV are consecutive from 2: for each actor its surface, then its objects.
RenderScene render_scene(const PreparedScene& prepared, const FrameGeometry& geometry);

}  // namespace polymorph
