// Bricks of cells, and the tree that finds those the surface can cross, each with its list of
// balls.
//
// The cells: those of the grid plus one rim of cells beyond each border, whose outer points count
// as outside (value 0), so that the surface is closed wherever the border cuts it. "Lattice point"
// e = grid point + 1: e = 0 and e = points + 1 are the rim.
//
// The tree: level 0 nodes are bricks of 4^3 cells; a node of level l has 4^3 children of level l -
// 1, down from one root. A node keeps the balls of its parent that reach it, in order, so that no
// sort and no atomic is needed: count, scan, fill. A node is dropped when the field cannot pass iso
// in it.
//
// Why culling is exact and not approximate: a ball is in a node's list if range().near <= limit.
// The coordinates of all points of a node lie between those of its two corner points (origin + cell
// * e rounds monotonically), and subtraction, product and fma round monotonically too, so no q
// computed at a point in the node is below the computed range().near (falloff.h). A ball left out
// therefore contributes exactly 0 at each point of the node, on its border as well, and at each
// point between two of them. A point of a ball's far side where coordinates overflow has q = NaN,
// and contributes 0 too.
#pragma once

#include <cstdint>

#include "falloff.h"
#include "field.h"
#include "host_device.h"
#include "types.h"
#include "view.h"

namespace polymorph {

constexpr int kBrickCells = 4;                 ///< along an axis
constexpr int kBrickPoints = kBrickCells + 1;  ///< along an axis, both borders included
constexpr int kBrickValues = kBrickPoints * kBrickPoints * kBrickPoints;
constexpr int kBrickStride = 128;  ///< values of a brick, padded to whole vectors
constexpr int kFan = 4;            ///< children along an axis
constexpr int kChildren = kFan * kFan * kFan;

/// One level of the tree: nodes along each axis, cells along a node's edge.
struct Level {
  Int3 nodes;
  int cells = kBrickCells;
};

struct Node {
  std::int64_t begin = 0;   ///< first entry of its ball list
  std::uint32_t count = 0;  ///< entries
  std::uint32_t index = 0;  ///< x + nodes.x (y + nodes.y z)
};

PM_HD inline Int3 node_position(Int3 nodes, std::int64_t index) {
  return {static_cast<int>(index % nodes.x), static_cast<int>(index / nodes.x % nodes.y),
          static_cast<int>(index / nodes.x / nodes.y)};
}

PM_HD inline std::int64_t node_index(Int3 nodes, Int3 p) {
  return p.x +
         static_cast<std::int64_t>(nodes.x) * (p.y + static_cast<std::int64_t>(nodes.y) * p.z);
}

/// Where child number `child` of a parent lies among the nodes of its own level.
PM_HD inline Int3 child_position(Int3 parent_nodes, const Node& parent, std::int64_t child) {
  const Int3 p = node_position(parent_nodes, parent.index);
  const int c = static_cast<int>(child % kChildren);
  return {p.x * kFan + c % kFan, p.y * kFan + c / kFan % kFan, p.z * kFan + c / kFan / kFan};
}

/// The grid points of a node, and whether rim points belong to it.
struct NodeBox {
  Vec3 low, high;
  bool has_rim = false;
};

PM_HD inline NodeBox node_box(const Grid& grid, const Level& level, Int3 p) {
  const Int3 first = {p.x * level.cells - 1, p.y * level.cells - 1, p.z * level.cells - 1};
  const Int3 last = {first.x + level.cells, first.y + level.cells, first.z + level.cells};
  const Int3 n = grid.points;
  const Int3 low = {first.x < 0 ? 0 : first.x, first.y < 0 ? 0 : first.y,
                    first.z < 0 ? 0 : first.z};
  const Int3 high = {last.x >= n.x ? n.x - 1 : last.x, last.y >= n.y ? n.y - 1 : last.y,
                     last.z >= n.z ? n.z - 1 : last.z};
  NodeBox box;
  box.low = grid_point(grid, low);
  box.high = grid_point(grid, high);
  box.has_rim = low.x != first.x || low.y != first.y || low.z != first.z || high.x != last.x ||
                high.y != last.y || high.z != last.z;
  return box;
}

/// How far a sum of `count` terms can differ from its bound, relative to the sum of their
/// magnitudes: rounding of both sums, and twice the error of power_of_two().
PM_HD inline float bound_margin(std::uint32_t count) {
  return 1e-6f + 2.5e-7f * static_cast<float>(count);
}

/// Which children of the parents the surface can cross, and how many balls reach them.
/// One item kLanes children of one parent; child i belongs to parent i / kChildren.
template <class F, int kLanes>
struct ClassifyNodes {
  static_assert(kChildren % kLanes == 0, "the lanes of an item share a parent");
  Grid grid;
  float iso = 1;
  Level level;  ///< of the children
  Int3 parent_nodes;
  View<const Node> parents;
  View<const std::uint32_t> entries;
  View<const typename F::Ball> balls;
  View<std::uint8_t> active;
  View<std::uint32_t> counts;

  struct Bounds {
    float lower[kLanes], upper[kLanes], magnitude[kLanes];
    std::uint32_t count[kLanes];  ///< balls that reach the box
  };

  PM_HD void operator()(std::int64_t item) const {
    const std::int64_t base = item * kLanes;
    if (base >= active.size) return;
    const Node parent = parents[base / kChildren];
    NodeBox box[kLanes];
    Points<kLanes> low, high;
    for (int l = 0; l < kLanes; ++l) {
      box[l] = node_box(grid, level, child_position(parent_nodes, parent, base + l));
      low.x[l] = box[l].low.x, low.y[l] = box[l].low.y, low.z[l] = box[l].low.z;
      high.x[l] = box[l].high.x, high.y[l] = box[l].high.y, high.z[l] = box[l].high.z;
    }
    Bounds field;
    bounds(low, high, {entries.data + parent.begin, parent.count}, field);
    for (int l = 0; l < kLanes; ++l) {
      const Int3 p = child_position(parent_nodes, parent, base + l);
      const float slack = field.magnitude[l] * bound_margin(field.count[l]);
      const bool outside = !(field.upper[l] + slack > iso);
      const bool inside = field.lower[l] - slack > iso && !box[l].has_rim;
      const bool exists = p.x < level.nodes.x && p.y < level.nodes.y && p.z < level.nodes.z;
      const bool keep = exists && !outside && !inside;
      active[base + l] = keep ? 1 : 0;
      counts[base + l] = keep && F::kEnds ? field.count[l] : 0;
    }
  }

  /// Bounds of the field over the box of each lane: each ball at its nearest and its furthest.
  PM_HD void bounds(const Points<kLanes>& box_low, const Points<kLanes>& box_high, BallList list,
                    Bounds& out) const {
    const Points<kLanes> low = box_low, high = box_high;
    Bounds sum;
    for (int l = 0; l < kLanes; ++l) {
      sum.lower[l] = sum.upper[l] = sum.magnitude[l] = 0;
      sum.count[l] = 0;
    }
    for (std::uint32_t j = 0; j < list.count; ++j) {
      const typename F::Ball ball = balls.data[list.indices[j]];
      PM_LANES
      for (int l = 0; l < kLanes; ++l) {
        const QRange<float> q =
            ball.range(low.x[l], high.x[l], low.y[l], high.y[l], low.z[l], high.z[l]);
        const float at_near = F::value(ball, q.near);
        const float at_far = F::value(ball, q.far);
        sum.lower[l] += least(at_near, at_far);
        sum.upper[l] += most(at_near, at_far);
        sum.magnitude[l] += most(at_near, -at_near);
        sum.count[l] += !F::kEnds || q.near <= ball.limit;
      }
    }
    out = sum;
  }
};

/// Writes the active children with their ball lists. One item a child.
template <class F>
struct FillNodes {
  Grid grid;
  Level level;
  Int3 parent_nodes;
  View<const Node> parents;
  View<const std::uint32_t> entries;
  View<const typename F::Ball> balls;
  View<const std::uint8_t> active;
  View<const std::uint32_t> slots;  ///< scan of active
  View<const std::int64_t> begins;  ///< scan of counts
  View<Node> nodes;
  View<std::uint32_t> node_entries;

  PM_HD void operator()(std::int64_t i) const {
    if (i >= active.size || !active[i]) return;
    const Node parent = parents[i / kChildren];
    const Int3 p = child_position(parent_nodes, parent, i);
    Node node;
    node.index = static_cast<std::uint32_t>(node_index(level.nodes, p));
    if (!F::kEnds) {
      node.begin = parent.begin;
      node.count = parent.count;
    } else {
      const NodeBox box = node_box(grid, level, p);
      node.begin = begins[i];
      node.count = static_cast<std::uint32_t>(begins[i + 1] - begins[i]);
      std::int64_t out = node.begin;
      for (std::uint32_t j = 0; j < parent.count; ++j) {
        const std::uint32_t index = entries.data[parent.begin + j];
        const typename F::Ball ball = balls.data[index];
        const QRange<float> q =
            ball.range(box.low.x, box.high.x, box.low.y, box.high.y, box.low.z, box.high.z);
        if (q.near <= ball.limit) node_entries[out++] = index;
      }
    }
    nodes[slots[i]] = node;
  }
};

/// Marks each active brick in the dense map. One item a brick found.
struct MarkBricks {
  View<const Node> found;
  View<std::uint8_t> marks;

  PM_HD void operator()(std::int64_t i) const {
    if (i < found.size) marks[found[i].index] = 1;
  }
};

/// Orders the bricks by their index in the lattice. One item a brick found.
struct OrderBricks {
  View<const Node> found;
  View<const std::uint32_t> map;  ///< scan of the marks
  View<Node> bricks;

  PM_HD void operator()(std::int64_t i) const {
    if (i < found.size) bricks[map[found[i].index]] = found[i];
  }
};

/// Field values at the 5^3 points of each brick; rim points are 0. One item kLanes points of one
/// brick.
template <class F, int kLanes>
struct SampleBricks {
  static_assert(kBrickStride % kLanes == 0, "the lanes of an item share a brick");
  Grid grid;
  Int3 brick_nodes;
  View<const Node> bricks;
  View<const std::uint32_t> entries;
  View<const typename F::Ball> balls;
  View<float> values;

  PM_HD void operator()(std::int64_t item) const {
    const std::int64_t base = item * kLanes;
    if (base >= values.size) return;
    const Node brick = bricks[base / kBrickStride];
    const Int3 p = node_position(brick_nodes, brick.index);
    Points<kLanes> at;
    bool rim[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const int local = static_cast<int>(base % kBrickStride) + l;
      const int i = local < kBrickValues ? local : kBrickValues - 1;
      const Int3 g = {p.x * kBrickCells + i % kBrickPoints - 1,
                      p.y * kBrickCells + i / kBrickPoints % kBrickPoints - 1,
                      p.z * kBrickCells + i / kBrickPoints / kBrickPoints - 1};
      rim[l] = g.x < 0 || g.y < 0 || g.z < 0 || g.x >= grid.points.x || g.y >= grid.points.y ||
               g.z >= grid.points.z;
      const Vec3 x = grid_point(grid, g);
      at.x[l] = x.x, at.y[l] = x.y, at.z[l] = x.z;
    }
    float value[kLanes];
    field_at<F>(at, balls.data, {entries.data + brick.begin, brick.count}, value);
    for (int l = 0; l < kLanes; ++l) values[base + l] = rim[l] ? 0.0f : value[l];
  }
};

}  // namespace polymorph
