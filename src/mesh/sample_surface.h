// Surface sampling: points distributed evenly over a model's faces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

struct SurfaceSample {
  Vec3 point;
  Vec3 normal;  ///< face normal, unit length
  std::uint32_t triangle = 0;
};

/// Draws `count` samples, each representing the same area: one per stratum of the area along a
/// Morton order of the triangles, so that consecutive samples are near in space. Faces without area
/// get none; a model without area gives an empty list. Deterministic.
std::vector<SurfaceSample> sample_surface(MeshView mesh, std::size_t count, std::uint64_t seed = 0);

}  // namespace polymorph
