// Self-intersection test of triangle meshes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "model/model.h"
#include "model/triangle_bvh.h"

namespace polymorph {

struct SelfIntersections {
  std::size_t pairs = 0;  ///< of triangles; at least this many if `stopped`
  bool stopped = false;   ///< the limit was reached, or `crowded`
  bool crowded = false;   ///< triangles lie so densely that not all pairs were looked at
  static constexpr std::size_t kMaxNear = 8192;
  std::uint32_t first[2] = {0, 0};  ///< the pair of lowest indices among those counted
};

/// Counts the pairs of triangles without a common point that cross properly: an edge of one passes
/// through the other's inside. Faces that only touch, or lie in one plane, do not count. Stops
/// after `most` pairs. What it does is bounded: near a triangle it looks at kMaxNear others, and
/// in all at some hundred for each. A function of its arguments alone.
SelfIntersections count_self_intersections(const Model& model, const TriangleBvh& bvh,
                                           std::size_t most = 10000);

}  // namespace polymorph
