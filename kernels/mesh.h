// Triangle mesh: the extracted surface as the kernels deliver it to the host.
#pragma once

#include <vector>

#include "types.h"

namespace polymorph {

/// An indexed triangle mesh. Triangles share their vertices, except those of
/// SurfaceMethod::kMatrix. The order of vertices and triangles depends on field and grid, never on
/// threads.
struct Mesh {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;  ///< unit, outward, one per position; none with ExtractSettings::flat
  std::vector<Triangle> triangles;
};

}  // namespace polymorph
