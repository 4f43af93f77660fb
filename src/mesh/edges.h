// Edge adjacency of triangle meshes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// One side of one triangle.
struct EdgeUse {
  std::uint32_t low = 0, high = 0;  ///< its points, low < high
  std::uint32_t corner = 0;  ///< 3 * triangle + k: the side runs from corner k to corner k + 1
  bool forward = true;       ///< it runs from low to high
};

/// The sides of all triangles, those of one edge together, in order of (low, high, corner). Sides
/// of length 0 (a repeated point) are left out.
std::vector<EdgeUse> sorted_edge_uses(std::span<const Triangle> triangles);

/// Calls f(first, last) for each run of uses of one edge.
template <class F>
void for_each_edge(const std::vector<EdgeUse>& uses, const F& f) {
  for (std::size_t first = 0; first < uses.size();) {
    std::size_t last = first + 1;
    while (last < uses.size() && uses[last].low == uses[first].low &&
           uses[last].high == uses[first].high)
      ++last;
    f(first, last);
    first = last;
  }
}

/// Finds the triangle across each side of each triangle, side k being from corner k to corner k +
/// 1: the triangle itself where an edge does not have two.
std::vector<Triangle> find_neighbours(std::span<const Triangle> triangles);

/// The corner that follows `corner` within its triangle.
inline std::uint32_t corner_after(std::uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}
/// The corner of a use at the edge's `low` end, and at its `high` end.
inline std::uint32_t low_corner(const EdgeUse& use) {
  return use.forward ? use.corner : corner_after(use.corner);
}
inline std::uint32_t high_corner(const EdgeUse& use) {
  return use.forward ? corner_after(use.corner) : use.corner;
}

}  // namespace polymorph
