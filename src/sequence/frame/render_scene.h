// Render scene of a frame: what the renderer is given.
#pragma once

#include "render/render.h"
#include "sequence/frame/frame_geometry.h"

namespace polymorph {

/// The meshes, camera and lights of one frame; borrows from both arguments. The id AOV counts from
/// 2 through the actors, for each its surface and then its objects' models.
RenderScene render_scene(const PreparedScene& prepared, const FrameGeometry& geometry);

}  // namespace polymorph
