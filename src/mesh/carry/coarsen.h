// Mesh coarsening by collapses of short edges, for the mesh that is carried.
#pragma once

#include <vector>

#include "kernels/types.h"

namespace polymorph {

struct CoarsenSettings {
  float edge = 0;       ///< edges shorter than this are collapsed; none grows beyond 1.5 times it
  float deviation = 0;  ///< maximum distance of a new point from the planes of its old triangles
};

/// Collapses edges of a closed mesh to their midpoints, short ones first (after Hoppe, DeRose,
/// Duchamp, McDonald and Stuetzle, Mesh optimization, 1993). Collapses that would change the
/// topology, turn a triangle by more than 32 degrees or exceed the deviation are left out.
void coarsen(std::vector<Vec3>& points, std::vector<Triangle>& triangles,
             const CoarsenSettings& settings);

}  // namespace polymorph
