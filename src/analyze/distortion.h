// Conformal distortion of a mesh whose points move: how far its triangles are sheared and
// stretched. Formula: docs/method.md, Quality.
#pragma once

#include "mesh/mesh_view.h"

namespace polymorph {

/// Tests whether two meshes have equally many points and the same triangles, whose corners may be
/// in another order.
bool corresponds(MeshView a, MeshView b);

/// Returns the mean quasi-conformal dilatation of the triangles of `before` as they become those of
/// `after`, which corresponds(): the quotient of the singular values, 1 if only size and position
/// change, at most 100 per triangle. A triangle's weight is the mean of its fractions of both
/// areas, so that exchanging the meshes gives the same result. The result is 0 if either mesh has
/// no area.
double conformal_distortion(MeshView before, MeshView after);

}  // namespace polymorph
