// Consistent orientation of a model's faces: neighbours agree, and components face outward.
#pragma once

#include <cstddef>

#include "model/model.h"

namespace polymorph {

struct Orientation {
  std::size_t flipped = 0;  ///< faces that were flipped
  std::size_t faces = 0;    ///< all faces
};

/// Flips faces so that the two faces of an edge traverse it in opposite directions, and each
/// component (faces connected by edges with exactly two faces) faces outward. A component with
/// inconsistent faces is oriented like most of its area, and then flipped if it faces inward. A
/// closed component faces inward if its signed volume is negative. An open one does if its own
/// winding number (without other components), averaged over eight of its faces, is below -0.05. A
/// consistent component is flipped only if it is certainly inside out: its volume is negative, or
/// that average is below -1/4, and it is no cavity of a surrounding component. Only the 64 such
/// components with the lowest first faces are examined. A component that cannot be oriented (a
/// Moebius strip) stays as it is, unless flipping reduces the number of inconsistent edges. Corner
/// normals are negated where they would face inward; normals of length 0 stay. A consistent outward
/// model is not modified. Time n log n.
Orientation orient_faces(Model& model);

}  // namespace polymorph
