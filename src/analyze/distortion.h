// Conformal distortion of a mesh whose points move: how far its triangles are sheared and
// stretched. Formula: docs/method.md, Quality.
#pragma once

#include "mesh/mesh_view.h"

namespace polymorph {

/// Tests whether two meshes have equally many points and the same triangles, up to the order of
/// their corners.
bool corresponds(MeshView a, MeshView b);

/// Returns the mean quasi-conformal dilatation of the triangles of `before` as they become those of
/// `after`. The meshes must be accepted by corresponds(). The dilatation is the quotient of the
/// singular values of a triangle's affine map, at most 100; it is 1 if only size and position
/// change. A triangle's weight is the mean of its fractions of both areas, so that exchanging the
/// meshes gives the same result. The result is 0 if either mesh has no area.
double conformal_distortion(MeshView before, MeshView after);

}  // namespace polymorph
