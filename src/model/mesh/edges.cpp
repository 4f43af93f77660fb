#include "model/mesh/edges.h"

#include <algorithm>

namespace polymorph {

std::vector<EdgeUse> sorted_edge_uses(const Model& model) {
  std::vector<EdgeUse> uses;
  uses.reserve(model.triangles.size() * 3);
  for (std::size_t t = 0; t < model.triangles.size(); ++t)
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t a = model.triangles[t].v[k], b = model.triangles[t].v[(k + 1) % 3];
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

}  // namespace polymorph
