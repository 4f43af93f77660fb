// Bounding volume hierarchy over the triangles of a scene, for machines that Embree does not know.
#pragma once

#include <cstdint>
#include <vector>

#include "render/rays/scene_build.h"

namespace polymorph {

/// A node with the boxes of its two children. A child >= 0 is a node; else it is a leaf, the
/// triangles [~child >> kLeafBits, + (~child & kLeafMask)) of the list. No triangles: an empty box.
struct BvhNode {
  Box boxes[2];
  std::int32_t children[2] = {-1, -1};
};
inline constexpr int kLeafBits = 3;
inline constexpr std::int32_t kLeafMask = (1 << kLeafBits) - 1;
/// A ray that descends into one child remembers the other, so this bounds its memory.
inline constexpr int kMaxBvhDepth = 48;

struct BvhTriangle {
  std::uint32_t mesh = 0, triangle = 0;
};

struct Bvh {
  std::vector<BvhNode> nodes;  ///< the first is the root
  std::vector<BvhTriangle> triangles;
};

/// Builds a hierarchy with Embree's builder (surface area heuristic). Boxes hold the triangles
/// while the shutter is open, and are larger by what floats may err. Errors: kResource.
Result<Bvh> build_bvh(const RayDevice& device, const TracedScene& scene);

}  // namespace polymorph
