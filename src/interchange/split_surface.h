// A surface whose vertices are split where its corners differ, as graphics hardware wants it.
#pragma once

#include <cstdint>
#include <vector>

#include "interchange/surface_frame.h"

namespace polymorph {

/// Vertices in the order of their first corners; corners alike in everything share one.
struct SplitSurface {
  std::vector<std::uint32_t> position_of;  ///< index into SurfaceFrame::positions, one per vertex
  std::vector<std::uint32_t> corner_of;    ///< the first corner at the vertex: 3 triangle + k
  std::vector<Triangle> triangles;
};

/// What tells corners at one point apart, beside the normals of corners.
struct SplitSettings {
  bool uvs = true;
  bool materials = false;
};
SplitSurface split_corners(const SurfaceFrame& frame, const SplitSettings& settings);

}  // namespace polymorph
