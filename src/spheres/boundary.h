// Boundary samples of a solid with their inner and outer medial balls (shrinking ball algorithm).
#pragma once

#include <cstddef>
#include <vector>

#include "mesh/inside.h"
#include "model/model.h"

namespace polymorph {

/// A point of the boundary between inside and outside.
struct BoundarySample {
  Vec3 point;
  Vec3 normal;  ///< outward, unit length, whichever way the face was turned
  /// Radii of the largest balls that touch the boundary here and lie inside / outside, as far as
  /// the samples tell, or the faces where walls are thin (shrinking balls: Ma et al. 2012); at most
  /// half the diagonal.
  float inner_radius = 0, outer_radius = 0;
};

/// About `count` samples, evenly spread. Faces that lie inside the solid or outside it (where parts
/// overlap, doubled or loose sheets) get none: a sample has inside on one side and outside on the
/// other. Empty when the model has no inside. In Morton order, so that neighbours in the list are
/// neighbours in space.
std::vector<BoundarySample> sample_boundary(const Model& model, const InsideTest& inside,
                                            std::size_t count);

}  // namespace polymorph
