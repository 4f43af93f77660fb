// Difference of two meshes: whether they are equal, and the distances between their surfaces.
#pragma once

#include "model/model.h"

namespace polymorph {

struct MeshDifference {
  bool is_same = false;  ///< equal points and triangles, in their order
  double mean = 0;       ///< chamfer distance over the reference's diagonal
  double largest = 0;  ///< Hausdorff distance of about 4000 samples per surface, over the diagonal
};

/// Compares two meshes. Distances are infinite if just one of the two has no triangles.
MeshDifference mesh_difference(const Model& actual, const Model& reference);

}  // namespace polymorph
