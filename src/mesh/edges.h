// Edge adjacency of triangle meshes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// One side of one triangle. The sides of all triangles between the same two points are the uses of
/// one edge.
struct EdgeUse {
  std::uint32_t low = 0, high = 0;  ///< indices of its end points, low < high
  std::uint32_t corner = 0;  ///< 3 * triangle + k: the side runs from corner k to k + 1 (mod 3)
  bool forward = true;       ///< the side runs from `low` to `high`
};

/// Lists the sides of all triangles, sorted by (low, high, corner), so that the uses of one edge
/// are adjacent. Sides of length 0 (a repeated point) are left out.
std::vector<EdgeUse> sorted_edge_uses(std::span<const Triangle> triangles);

/// Calls f(first, last) for each edge, whose uses are uses[first] to uses[last - 1].
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

/// Finds, as v[k] of each result, the triangle across side k (from corner k to corner k + 1 mod 3)
/// of the triangle. It is the triangle itself if the edge does not have exactly two triangles.
std::vector<Triangle> find_neighbours(std::span<const Triangle> triangles);

/// Counts the fans of triangles around each of the `points` points: two corners at a point belong
/// to one fan if their triangles share an edge there. `uses`: sorted_edge_uses(triangles).
std::vector<std::uint32_t> count_fans(std::size_t points, std::span<const Triangle> triangles,
                                      const std::vector<EdgeUse>& uses);

/// The corner that follows `corner` within its triangle.
inline std::uint32_t next_corner(std::uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}
/// The triangle's corner at the `low` end of the edge, and that at the `high` end.
inline std::uint32_t low_corner(const EdgeUse& use) {
  return use.forward ? use.corner : next_corner(use.corner);
}
inline std::uint32_t high_corner(const EdgeUse& use) {
  return use.forward ? next_corner(use.corner) : use.corner;
}

}  // namespace polymorph
