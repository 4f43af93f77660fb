#include "mesh/winding_slope.h"

#include <cmath>
#include <cstdlib>
#include <limits>

#include "base/exact_math.h"
#include "kernels/linear.h"
#include "kernels/simd_math.h"
#include "mesh/edges.h"

namespace polymorph {

OpenEdges find_open_edges(MeshView mesh) {
  constexpr auto kCount = static_cast<std::size_t>(Lanes<Pack>::kCount);
  OpenEdges edges;
  const auto add_edge = [&](Vec3 middle, float half, float weight) {
    edges.x.push_back(middle.x), edges.y.push_back(middle.y), edges.z.push_back(middle.z);
    edges.half_length.push_back(half);
    edges.weight.push_back(weight);
  };
  const std::vector<EdgeUse> uses = sorted_edge_uses(mesh.triangles);
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    int difference = 0;
    for (std::size_t i = first; i < last; ++i) difference += uses[i].forward ? 1 : -1;
    if (difference == 0) return;
    const Vec3 a = mesh.points[uses[first].low], b = mesh.points[uses[first].high];
    const float edge_length = length(b - a);
    add_edge((a + b) * 0.5f, 0.5f * edge_length,
             static_cast<float>(std::abs(difference)) * edge_length /
                 (4 * static_cast<float>(exact::kPi)));
  });
  edges.count = edges.x.size();
  while (edges.x.size() % kCount != 0) add_edge({}, /*half=*/0, /*weight=*/0);
  return edges;
}

float max_winding_slope(const OpenEdges& edges, Vec3 center, float radius) {
  constexpr auto kCount = static_cast<std::size_t>(Lanes<Pack>::kCount);
  constexpr float kRounding = 1.001f;
  Pack sum = {}, nearest = broadcast<Pack>(std::numeric_limits<float>::max());
  for (std::size_t i = 0; i < edges.x.size(); i += kCount) {
    const Pack x = Lanes<Pack>::load(&edges.x[i]) - center.x,
               y = Lanes<Pack>::load(&edges.y[i]) - center.y,
               z = Lanes<Pack>::load(&edges.z[i]) - center.z;
    const Pack weight = Lanes<Pack>::load(&edges.weight[i]);
    const Pack distance = sqrt(x * x + y * y + z * z) -
                          kRounding * (radius + Lanes<Pack>::load(&edges.half_length[i]));
    // Edges of weight 0 fill the last pack.
    nearest = min(nearest, select(weight > 0.0f, distance, nearest));
    sum += weight / max(distance * distance, broadcast<Pack>(std::numeric_limits<float>::min()));
  }
  float total = 0;
  for (std::size_t l = 0; l < kCount; ++l) {
    if (!(nearest[l] > 0)) return std::numeric_limits<float>::infinity();
    total += sum[l];
  }
  return kRounding * total;
}

}  // namespace polymorph
