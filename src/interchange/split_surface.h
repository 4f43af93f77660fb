// Splitting of vertices whose corners have different attributes, as graphics hardware requires.
#pragma once

#include <cstdint>
#include <vector>

#include "interchange/surface_frame.h"

namespace polymorph {

/// Vertices in the order of their first corners; corners with equal attributes share one.
struct SplitSurface {
  std::vector<std::uint32_t> position_of;  ///< index into SurfaceFrame::positions, one per vertex
  std::vector<std::uint32_t> corner_of;    ///< the first corner at the vertex: 3 triangle + k
  std::vector<Triangle> triangles;
};

/// Attributes by which the corners at a point are split, in addition to corner normals.
struct SplitSettings {
  bool uvs = true;
  bool materials = false;
};
SplitSurface split_corners(const SurfaceFrame& frame, const SplitSettings& settings);

}  // namespace polymorph
