#include "mesh/edges.h"

#include <algorithm>

namespace polymorph {

std::vector<EdgeUse> sorted_edge_uses(std::span<const Triangle> triangles) {
  std::vector<EdgeUse> uses;
  uses.reserve(triangles.size() * 3);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t].v[k], b = triangles[t].v[(k + 1) % 3];
      if (a == b) continue;
      uses.push_back(
          {std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(3 * t + k), a < b});
    }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    if (a.low != b.low) return a.low < b.low;
    if (a.high != b.high) return a.high < b.high;
    return a.corner < b.corner;
  });
  return uses;
}

std::vector<Triangle> find_neighbours(std::span<const Triangle> triangles) {
  std::vector<Triangle> neighbours(triangles.size());
  for (std::uint32_t f = 0; f < triangles.size(); ++f) neighbours[f] = {{f, f, f}};
  const std::vector<EdgeUse> uses = sorted_edge_uses(triangles);
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    if (last - first != 2) return;
    const std::uint32_t a = uses[first].corner, b = uses[first + 1].corner;
    neighbours[a / 3].v[a % 3] = b / 3;
    neighbours[b / 3].v[b % 3] = a / 3;
  });
  return neighbours;
}

}  // namespace polymorph
