#include "render/device/bvh.h"

#include <algorithm>
#include <utility>

#include "render/device/device_scene.h"

namespace polymorph {

Bvh build_bvh(const DeviceScene& scene) {
  struct SortedTriangle {
    std::uint32_t position;
    BvhTriangle triangle;
  };
  // Sort the triangles along the curve. Each begins as a cluster.
  std::vector<SortedTriangle> sorted;
  for (std::uint32_t m = 0; m < scene.meshes.size(); ++m)
    for (std::uint32_t t = 0; t < scene.mesh(m).triangles.size(); ++t) {
      const Box box = scene.triangle_box({m, t});
      sorted.push_back({curve_position(box.center(), scene.bounds), {m, t}});
    }
  std::stable_sort(
      sorted.begin(), sorted.end(),
      [](const SortedTriangle& a, const SortedTriangle& b) { return a.position < b.position; });
  Bvh bvh;
  std::vector<BvhCluster> clusters;
  for (const auto& [position, triangle] : sorted) {
    clusters.push_back(
        {scene.triangle_box(triangle), ~static_cast<std::int32_t>(bvh.triangles.size())});
    bvh.triangles.push_back(triangle);
  }
  // Merge clusters in rounds until one is left.
  for (int round = 0; clusters.size() > 1; ++round) {
    const int count = static_cast<int>(clusters.size());
    std::vector<int> nearest;
    for (int i = 0; i < count; ++i) nearest.push_back(nearest_cluster(clusters.data(), count, i));
    std::vector<BvhCluster> merged;
    for (int i = 0; i < count; ++i) {
      const int partner = merge_partner(nearest.data(), count, i, round);
      if (partner >= 0 && partner < i) continue;  // the partner has merged both
      merged.push_back(clusters[static_cast<std::size_t>(i)]);
      if (partner < 0) continue;
      const BvhCluster &a = merged.back(), &b = clusters[static_cast<std::size_t>(partner)];
      bvh.nodes.push_back({{a.box, b.box}, {a.node, b.node}});
      merged.back() = {unite(a.box, b.box), static_cast<std::int32_t>(bvh.nodes.size()) - 1};
    }
    clusters = std::move(merged);
  }
  // Traversal begins at a node, so a single triangle gets one.
  if (bvh.nodes.empty() && !clusters.empty())
    bvh.nodes.push_back({{clusters[0].box, clusters[0].box}, {clusters[0].node, clusters[0].node}});
  bvh.root = static_cast<std::int32_t>(bvh.nodes.size()) - 1;
  return bvh;
}

}  // namespace polymorph
