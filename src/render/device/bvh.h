// Bounding volume hierarchy over the triangles of a scene, for machines that Embree does not know.
// Triangles are put in the order of a space-filling curve, and then those clusters are merged,
// round after round, that are each other's nearest among their neighbours in that order: parallel
// locally-ordered clustering (Meister and Bittner 2018). The steps for one triangle or cluster
// stand here, for loops of the CPU and for a GPU's threads.
#pragma once

#include <cstdint>
#include <vector>

#include "base/box.h"
#include "kernels/host_device.h"
#include "kernels/types.h"

namespace polymorph {

/// A node with the boxes of its two children. A child >= 0 is a node, else ~child is a triangle of
/// the hierarchy's list.
struct alignas(16) BvhNode {
  Box boxes[2];
  std::int32_t children[2] = {-1, -1};
};
static_assert(sizeof(BvhNode) == 64);

/// Reads a node, on a GPU with four instructions.
PM_HD inline BvhNode load_node(const BvhNode* nodes, std::uint32_t index) {
#if defined(__CUDA_ARCH__)
  const auto* from = reinterpret_cast<const float4*>(nodes + index);
  const float4 a = __ldg(from), b = __ldg(from + 1), c = __ldg(from + 2), d = __ldg(from + 3);
  return {{{{a.x, a.y, a.z}, {a.w, b.x, b.y}}, {{b.z, b.w, c.x}, {c.y, c.z, c.w}}},
          {__float_as_int(d.x), __float_as_int(d.y)}};
#else
  return nodes[index];
#endif
}

struct BvhTriangle {
  std::uint32_t mesh = 0, triangle = 0;
};

struct BvhCluster {
  Box box;
  std::int32_t node = 0;  ///< a node or triangle, like BvhNode::children
};

/// Clusters look this far along the curve, to both sides, for the nearest one.
inline constexpr int kBvhRadius = 8;
/// After these rounds each cluster is merged with its neighbour, which bounds the depth.
inline constexpr int kMaxBvhRounds = 32;
/// A ray that descends into one child remembers the other, so this bounds its memory: clusters of
/// 2^31 triangles are merged in 31 more rounds.
inline constexpr int kMaxBvhDepth = kMaxBvhRounds + 31;

/// Position of a point on a Z-order curve through a box of 2^10 cells along each axis.
PM_HD inline std::uint32_t curve_position(Vec3 p, const Box& box) {
  const auto spread = [](float x, float low, float high) {
    const float cells = 1024 * ((x - low) / (high - low));
    // NaN, of a flat box, becomes 0.
    std::uint32_t v = cells > 0 ? static_cast<std::uint32_t>(cells < 1023 ? cells : 1023.0f) : 0;
    v = (v | (v << 16)) & 0x030000ffu;
    v = (v | (v << 8)) & 0x0300f00fu;
    v = (v | (v << 4)) & 0x030c30c3u;
    return (v | (v << 2)) & 0x09249249u;
  };
  return spread(p.x, box.low.x, box.high.x) | (spread(p.y, box.low.y, box.high.y) << 1) |
         (spread(p.z, box.low.z, box.high.z) << 2);
}

/// Half of a box's surface area.
PM_HD inline float half_area(const Box& box) {
  const Vec3 size = box.high - box.low;
  return size.x * size.y + size.y * size.z + size.z * size.x;
}

/// Index of the cluster with which cluster i makes the smallest box, among its neighbours on the
/// curve; -1 if there is only one. Of equally small ones the one whose index differs from i in
/// lower bits counts: an order of pairs that both members share, so that each round merges some,
/// and equal boxes half of them.
PM_HD inline int nearest_cluster(const BvhCluster* clusters, int count, int i) {
  int nearest = -1;
  float smallest = 0;
  for (int j = i > kBvhRadius ? i - kBvhRadius : 0; j < count && j <= i + kBvhRadius; ++j) {
    if (j == i) continue;
    const float area = half_area(unite(clusters[i].box, clusters[j].box));
    if (nearest >= 0 && (area > smallest || (area == smallest && (i ^ j) > (i ^ nearest))))
      continue;
    nearest = j;
    smallest = area;
  }
  return nearest;
}

/// Index of the cluster with which cluster i is merged in this round; -1 for none.
PM_HD inline int merge_partner(const int* nearest, int count, int i, int round) {
  if (round >= kMaxBvhRounds) return (i ^ 1) < count ? i ^ 1 : -1;
  return nearest[i] >= 0 && nearest[nearest[i]] == i ? nearest[i] : -1;
}

struct Bvh {
  std::vector<BvhNode> nodes;
  std::vector<BvhTriangle> triangles;
  std::int32_t root = 0;  ///< index of the node
};

struct DeviceScene;

/// Builds the hierarchy of a packed scene on the CPU. Boxes hold the triangles while the shutter is
/// open, and are larger by what floats may err.
Bvh build_bvh(const DeviceScene& scene);

}  // namespace polymorph
