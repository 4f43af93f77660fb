// Self-intersection test of triangle meshes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mesh/mesh_view.h"
#include "mesh/triangle_bvh.h"

namespace polymorph {

struct SelfIntersections {
  std::size_t pairs = 0;  ///< pairs of triangles; a lower bound if `stopped`
  bool stopped = false;   ///< the limit was reached, or `crowded`
  bool crowded = false;   ///< too many triangles overlap to test all pairs
  static constexpr std::size_t kMaxWork = 32768;  ///< steps around one triangle
  std::uint32_t first[2] = {0, 0};                ///< the first pair counted
};

/// Counts the pairs of triangles without a common point that cross properly: an edge of one passes
/// through the other's interior. Faces that only touch, or are coplanar, do not count. Stops after
/// `max_pairs` pairs. The work is bounded, in steps that are a box test or a sixteenth of a pair
/// test: kMaxWork per triangle, and in total 2^26 plus 128 per triangle. Deterministic.
SelfIntersections count_self_intersections(MeshView mesh, const TriangleBvh& bvh,
                                           std::size_t max_pairs = 10000);

}  // namespace polymorph
