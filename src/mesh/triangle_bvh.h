// Bounding volume hierarchy (BVH) over triangles with eight children per node, for closest-point,
// ray and pair queries.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/box.h"
#include "kernels/types.h"

namespace polymorph {

struct TriangleBvh {
  static constexpr int kWidth = 8;
  static constexpr std::size_t kLeafTriangles = 8;
  static constexpr std::uint32_t kNone = 0xffffffffu;
  /// Deep enough for any traversal: seven siblings per level stay on the stack, and eight-wide
  /// nodes over 2^32 triangles are at most 12 levels deep.
  static constexpr int kStackSize = 96;

  /// Boxes indexed by coordinate and child, so that one loop handles all children as vectors.
  /// Absent children have an empty box and `child` kNone.
  struct Node {
    float low[3][kWidth], high[3][kWidth];
    std::uint32_t child[kWidth];  ///< index of the child node, or first slot of the child leaf
    std::uint32_t count[kWidth];  ///< triangles of a child leaf; 0: the child is a node or absent
  };
  struct Corners {
    Vec3 p[3];
  };

  std::vector<Node> nodes;  ///< the root first; empty without triangles
  /// Triangle corners per slot. Leaves follow each other, each beginning at a multiple of
  /// kLeafTriangles.
  std::vector<Corners> corners;
  std::vector<std::uint32_t> triangles;  ///< original triangle index per slot, or kNone
  bool is_split = false;                 ///< triangles may have several slots
};

/// Builds a hierarchy in which each triangle has one slot. Deterministic.
TriangleBvh build_triangle_bvh(std::span<const Vec3> points, std::span<const Triangle> triangles);

/// Builds a hierarchy with spatial splits if many triangles are long: more than 4096 are longer
/// than a 16th of the box's diagonal, or more than 1024 are and a point of the box lies in 16 of
/// their boxes on average. Triangles are then cut into pieces of a 64th of the diagonal or more,
/// and each piece has a slot and a box of its own. Without splits, the boxes of thin triangles that
/// share a point all overlap, and every ray would hit most of them. Other meshes get the hierarchy
/// of build_triangle_bvh().
TriangleBvh build_split_bvh(std::span<const Vec3> points, std::span<const Triangle> triangles);

/// Tests which children of a node the box touches; bit k stands for child k.
inline unsigned children_touching(const TriangleBvh::Node& node, const Box& box) {
  unsigned touching = 0;
  for (int k = 0; k < TriangleBvh::kWidth; ++k) {
    const bool disjoint = node.low[0][k] > box.high.x || node.high[0][k] < box.low.x ||
                          node.low[1][k] > box.high.y || node.high[1][k] < box.low.y ||
                          node.low[2][k] > box.high.z || node.high[2][k] < box.low.z;
    touching |= (disjoint || node.child[k] == TriangleBvh::kNone ? 0u : 1u) << k;
  }
  return touching;
}

/// Tests whether the bounds of a triangle touch the box.
inline bool bounds_touch(const TriangleBvh::Corners& c, const Box& box) {
  const Vec3 low = min(c.p[0], min(c.p[1], c.p[2])), high = max(c.p[0], max(c.p[1], c.p[2]));
  return box.low.x <= high.x && box.high.x >= low.x && box.low.y <= high.y && box.high.y >= low.y &&
         box.low.z <= high.z && box.high.z >= low.z;
}

/// Calls visit(first slot, number of slots) for the leaves whose boxes touch the box. Ends before a
/// node for which goes_on() returns false.
template <class GoesOn, class Visit>
void for_each_touching_leaf(std::span<const TriangleBvh::Node> nodes, const Box& box,
                            const GoesOn& goes_on, const Visit& visit) {
  std::uint32_t stack[TriangleBvh::kStackSize];
  int stack_size = 0;
  if (!nodes.empty()) stack[stack_size++] = 0;
  while (stack_size > 0 && goes_on()) {
    const TriangleBvh::Node& node = nodes[stack[--stack_size]];
    const unsigned touching = children_touching(node, box);
    for (int k = 0; k < TriangleBvh::kWidth; ++k) {
      if (!(touching >> k & 1)) continue;
      if (node.count[k] == 0)
        stack[stack_size++] = node.child[k];
      else
        visit(node.child[k], node.count[k]);
    }
  }
}

}  // namespace polymorph
