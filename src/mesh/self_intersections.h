// Self-intersection test of triangle meshes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mesh/mesh_view.h"
#include "mesh/triangle_bvh.h"

namespace polymorph {

struct SelfIntersections {
  std::size_t pairs = 0;  ///< pairs of triangles; a lower bound if `stopped`
  bool stopped = false;   ///< `max_pairs` was reached, or `crowded`
  bool crowded = false;   ///< too many triangles overlap to test all pairs
  static constexpr std::size_t kMaxWork = 32768;  ///< steps per triangle
  std::uint32_t first[2] = {0, 0};                ///< triangles of the first pair, if any
};

/// Counts the pairs of triangles without a common corner that cross properly: an edge of one passes
/// through the other's interior. Faces that only touch, or are coplanar, do not count. Stops after
/// `max_pairs` pairs. The work is bounded by kMaxWork steps per triangle and by 2^26 + 128 n steps
/// for n triangles; a box test is one step, a pair test 16. Deterministic.
SelfIntersections count_self_intersections(MeshView mesh, const TriangleBvh& bvh,
                                           std::size_t max_pairs = 10000);

}  // namespace polymorph
