// Triangle mesh: the extracted surface as the kernels deliver it to the host.
#pragma once

#include <vector>

#include "types.h"

namespace polymorph {

/// An indexed triangle mesh. Every vertex is shared by the triangles around it; vertex and triangle
/// order depend only on the grid, never on threads.
struct Mesh {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;  ///< unit, outward (-grad field); one per position
  std::vector<Triangle> triangles;
};

}  // namespace polymorph
