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
  Vec3 normal;  ///< outward, unit length, regardless of the face's orientation
  /// Radii of the largest balls that touch the boundary here and lie inside (outside) the solid
  /// (shrinking balls: Ma et al. 2012). They are limited by the other samples, at thin walls also
  /// by the faces, and by half the diagonal of the model's box.
  float inner_radius = 0, outer_radius = 0;
};

/// Draws about `count` samples, evenly distributed. A sample has the inside on one side only, so
/// faces that lie inside or outside the solid (overlapping parts, doubled or loose sheets) get
/// none. The list is empty if the model has no inside. It is in Morton order, so that neighbours in
/// the list are mostly neighbours in space.
std::vector<BoundarySample> sample_boundary(const Model& model, const InsideTest& inside,
                                            std::size_t count);

}  // namespace polymorph
