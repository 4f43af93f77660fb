#include "mesh/edges.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "base/disjoint_sets.h"

namespace polymorph {

std::vector<EdgeUse> sorted_edge_uses(std::span<const Triangle> triangles) {
  const auto for_each_use = [&](const auto& f) {
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangles[t].v[k], b = triangles[t].v[(k + 1) % 3];
        if (a != b)
          f(EdgeUse{std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(3 * t + k), a < b});
      }
  };
  // A counting sort by `low` comes first; then the few uses of each vertex are sorted.
  std::vector<std::size_t> begin;  // first use per vertex `low`
  for_each_use([&](const EdgeUse& use) {
    if (use.low + std::size_t{2} > begin.size()) begin.resize(use.low + std::size_t{2});
    ++begin[use.low + 1];
  });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<EdgeUse> uses(begin.empty() ? 0 : begin.back());
  std::vector<std::size_t> next = begin;
  for_each_use([&](const EdgeUse& use) { uses[next[use.low]++] = use; });
  for (std::size_t v = 0; v + 1 < begin.size(); ++v)
    std::sort(uses.begin() + static_cast<std::ptrdiff_t>(begin[v]),
              uses.begin() + static_cast<std::ptrdiff_t>(begin[v + 1]),
              [](const EdgeUse& a, const EdgeUse& b) {
                return a.high != b.high ? a.high < b.high : a.corner < b.corner;
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

std::vector<std::uint32_t> count_fans(std::size_t points, std::span<const Triangle> triangles,
                                      const std::vector<EdgeUse>& uses) {
  DisjointSets fans(triangles.size() * 3);
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first + 1; i < last; ++i) {
      fans.join(low_corner(uses[first]), low_corner(uses[i]));
      fans.join(high_corner(uses[first]), high_corner(uses[i]));
    }
  });
  std::vector<std::uint32_t> counts(points, 0);
  for (std::uint32_t c = 0; c < fans.size(); ++c)
    if (fans.find(c) == c) ++counts[triangles[c / 3].v[c % 3]];
  return counts;
}

}  // namespace polymorph
