// Difference of two meshes: whether they are the same, and how far apart their surfaces are.
#pragma once

#include "model/model.h"

namespace polymorph {

struct MeshDifference {
  bool is_same = false;  ///< equal points and triangles, in their order
  double mean = 0;       ///< chamfer distance over the reference's diagonal
  double largest = 0;    ///< Hausdorff distance over that, of about 4000 samples of each surface
};

/// Distances are infinite where one of the two has no triangles.
MeshDifference mesh_difference(const Model& actual, const Model& reference);

}  // namespace polymorph
