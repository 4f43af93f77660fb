// Bounding volume hierarchy over the triangles of a scene, for processors that Embree does not
// support. Triangles are sorted along a space-filling curve. Then each round merges the pairs of
// clusters that are each other's nearest among their neighbours on the curve: parallel
// locally-ordered clustering (Meister and Bittner 2018). This file has the steps for one triangle
// or cluster, which the CPU's loops and the GPU's threads share.
#pragma once

#include <cstdint>
#include <vector>

#include "base/box.h"
#include "kernels/host_device.h"
#include "kernels/types.h"

namespace polymorph {

/// A node with the boxes of its two children. A child >= 0 is the index of a node; otherwise ~child
/// is an index in Bvh::triangles.
struct alignas(16) BvhNode {
  Box boxes[2];
  std::int32_t children[2] = {-1, -1};
};
static_assert(sizeof(BvhNode) == 64);

/// Reads a node; a GPU needs four load instructions.
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

/// Indices of a mesh and of one of its triangles.
struct BvhTriangle {
  std::uint32_t mesh = 0, triangle = 0;
};

/// A subtree of the hierarchy under construction.
struct BvhCluster {
  Box box;
  std::int32_t node = 0;  ///< the cluster's node or triangle, encoded like BvhNode::children
};

/// Number of neighbours on either side along the curve among which the nearest cluster is searched.
inline constexpr int kBvhRadius = 8;
/// After this many rounds each cluster is merged with its neighbour, which bounds the depth.
inline constexpr int kMaxBvhRounds = 32;
/// Maximum depth, and so the maximum size of a ray's stack: 2^31 clusters are merged in 31 more
/// rounds.
inline constexpr int kMaxBvhDepth = kMaxBvhRounds + 31;

/// Computes the position of a point on a Z-order curve through a box of 2^10 cells along each axis.
PM_HD inline std::uint32_t curve_position(Vec3 p, const Box& box) {
  const auto interleave = [](float x, float low, float high) {
    const float cells = 1024 * ((x - low) / (high - low));
    // A flat box gives NaN, which becomes 0.
    std::uint32_t v = cells > 0 ? static_cast<std::uint32_t>(cells < 1023 ? cells : 1023.0f) : 0;
    v = (v | (v << 16)) & 0x030000ffu;
    v = (v | (v << 8)) & 0x0300f00fu;
    v = (v | (v << 4)) & 0x030c30c3u;
    return (v | (v << 2)) & 0x09249249u;
  };
  return interleave(p.x, box.low.x, box.high.x) | (interleave(p.y, box.low.y, box.high.y) << 1) |
         (interleave(p.z, box.low.z, box.high.z) << 2);
}

/// Computes half of a box's surface area.
PM_HD inline float half_area(const Box& box) {
  const Vec3 size = box.high - box.low;
  return size.x * size.y + size.y * size.z + size.z * size.x;
}

/// Returns the index j of the cluster that with cluster i makes the smallest box, among the
/// neighbours of i on the curve, or -1 if there is only one cluster. Of equally small boxes it
/// takes the one with the smallest i XOR j. Since this order is the same for both clusters of a
/// pair, each round merges some pairs, and halves the number of clusters if all boxes are equal.
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

/// Returns the index of the cluster with which cluster i is merged in this round, or -1 for none.
/// `nearest`: nearest_cluster() of each cluster.
PM_HD inline int merge_partner(const int* nearest, int count, int i, int round) {
  if (round >= kMaxBvhRounds) return (i ^ 1) < count ? i ^ 1 : -1;
  return nearest[i] >= 0 && nearest[nearest[i]] == i ? nearest[i] : -1;
}

struct Bvh {
  std::vector<BvhNode> nodes;
  std::vector<BvhTriangle> triangles;
  std::int32_t root = 0;  ///< index of the root node, or -1 without triangles
};

struct DeviceScene;

/// Builds the hierarchy of a packed scene on the CPU. Boxes contain the triangles while the shutter
/// is open, plus a margin for float errors.
Bvh build_bvh(const DeviceScene& scene);

}  // namespace polymorph
