// Signed distances of vessels' walls (model/repair/vessel.h).
#pragma once

#include "kernels/morph_surface.h"

namespace polymorph {

/// Changes the distances of a vessel's walls (positive inside the walls) so that they can be mixed
/// with another object's distances. In the cavity they decrease more slowly, so that in a mix the
/// walls grow evenly thicker until they meet. `filled`: distances of the filled vessel, on the same
/// grid.
DistanceGrid hollow_distances(DistanceGrid walls, const DistanceGrid& filled);

}  // namespace polymorph
