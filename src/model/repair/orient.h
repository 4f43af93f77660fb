// Consistent orientation of a model's faces: neighbours agree, and outside is outside.
#pragma once

#include <cstddef>

#include "model/model.h"

namespace polymorph {

struct Orientation {
  std::size_t turned = 0;  ///< faces that were turned around
  std::size_t of = 0;      ///< all of them
};

/// Turns faces around so that those on either side of an edge of two faces run along it in opposite
/// directions, and each component (faces joined by such edges) looks outward. A component whose
/// faces disagree takes the side that its signed volume tells where it is closed, else the winding
/// number of its own faces at eight of them, else that of most of its area. One whose faces agree
/// is turned only where it is inside out beyond doubt: with negative volume, or a winding number of
/// its faces below -1/4, and not a cavity of something around it (of such components the 64 with
/// the lowest first faces are looked at). A component that cannot be oriented (a Moebius strip)
/// keeps its faces, unless fewer edges disagree once they are turned. Corners' normals follow where
/// they then look inward, normals of length 0 stay. A model that needs nothing is not touched. Time
/// n log n.
Orientation orient_faces(Model& model);

}  // namespace polymorph
