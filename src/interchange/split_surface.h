// Splitting of vertices whose corners have different attributes, as graphics hardware requires.
#pragma once

#include <cstdint>
#include <vector>

#include "interchange/surface_frame.h"

namespace polymorph {

/// Vertices of a surface, in the order of their first corners. The corners at a point share a
/// vertex if their attributes are equal. Corner 3 t + k is corner k of triangle t.
struct SplitSurface {
  std::vector<std::uint32_t> position_of;  ///< index into SurfaceFrame::positions, one per vertex
  std::vector<std::uint32_t> corner_of;    ///< index of the first corner, one per vertex
  std::vector<Triangle> triangles;         ///< the surface's triangles, with indices of vertices
};

/// Attributes by which the corners at a point are split, in addition to corner normals.
struct SplitSettings {
  bool uvs = true;
  bool materials = false;
};
/// Splits the points of a surface into vertices whose corners have equal attributes.
SplitSurface split_corners(const SurfaceFrame& frame, const SplitSettings& settings);

}  // namespace polymorph
