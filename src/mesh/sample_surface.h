// Surface sampling: points spread evenly over a model's faces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

struct SurfaceSample {
  Vec3 point;
  Vec3 normal;  ///< of its face, unit length
  std::uint32_t triangle = 0;
};

/// `count` samples, each standing for the same area: one per stratum of the area along a
/// space-filling order of the triangles, so that neighbours in the list are neighbours in space.
/// Faces without area get none; a model without area gives an empty list. A function of its
/// arguments alone.
std::vector<SurfaceSample> sample_surface(MeshView mesh, std::size_t count, std::uint64_t seed = 0);

}  // namespace polymorph
