// Self-intersection test of triangle meshes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mesh/mesh_view.h"
#include "mesh/triangle_bvh.h"

namespace polymorph {

struct SelfIntersections {
  std::size_t pairs = 0;  ///< of triangles; at least this many if `stopped`
  bool stopped = false;   ///< the limit was reached, or `crowded`
  bool crowded = false;   ///< triangles lie so densely that not all pairs were looked at
  static constexpr std::size_t kMaxWork = 32768;  ///< around one triangle
  std::uint32_t first[2] = {0, 0};  ///< the pair of lowest indices among those counted
};

/// Counts the pairs of triangles without a common point that cross properly: an edge of one passes
/// through the other's inside. Faces that only touch, or lie in one plane, do not count. Stops
/// after `max_pairs` pairs. What it does is bounded, in steps that are a look at a box or a
/// sixteenth of a look at a pair: kMaxWork near a triangle, 2^26 and 128 for each triangle in all.
/// A function of its arguments alone.
SelfIntersections count_self_intersections(MeshView mesh, const TriangleBvh& bvh,
                                           std::size_t max_pairs = 10000);

}  // namespace polymorph
