// Conformal distortion of a mesh whose points move: how far its triangles are sheared and
// stretched. Formula: docs/method.md, Quality.
#pragma once

#include "mesh/mesh_view.h"

namespace polymorph {

/// Tests whether two meshes have the same triangles over as many points, whichever way these turn.
bool corresponds(MeshView a, MeshView b);

/// Returns the mean quasi-conformal dilatation of the triangles of `before` as they become those of
/// `after`, which corresponds(): the quotient of the singular values, 1 where only size and place
/// change, at most 100 each. A triangle counts by the mean of its shares of both areas, so that the
/// result is the same both ways; 0 if either has no area.
double conformal_distortion(MeshView before, MeshView after);

}  // namespace polymorph
