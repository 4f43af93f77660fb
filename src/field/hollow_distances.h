// The walls of vessels (model/repair/vessel.h) as distances.
#pragma once

#include "kernels/morph_surface.h"

namespace polymorph {

/// Makes distances of a vessel's walls that can be mixed with those of the filled vessel, on the
/// same grid: inside the cavity they decrease more slowly, so that in a mix the walls grow evenly
/// thicker until they meet.
DistanceGrid hollow_distances(DistanceGrid walls, const DistanceGrid& filled);

}  // namespace polymorph
