// Sparse octree-like tree (branching 4^3) that culls balls: it finds the bricks of cells that the
// surface can cross, each with its list of balls.
//
// The cells: those of the grid plus one rim of cells beyond each border, whose outer points count
// as outside (value 0), so that the surface is closed wherever the border cuts it. "Lattice point"
// e = grid point + 1: e = 0 and e = points + 1 are the rim.
//
// Level 0 nodes are bricks of 7^3 cells, so that a brick has 8^3 points; a node of level l has 4^3
// children of level l - 1, down from the roots, whose lists are of all balls. A node keeps the
// balls of its parent that reach it, in order, so that no sort is needed: count, scan, fill. Where
// support is infinite, those reach it that are not distant (far_field.h). A child is dropped when
// the field cannot pass iso in it. Nodes of a level stand in the order of their parents, and a
// parent knows its children as 64 bits and the number of the first: so any brick is found from its
// place.
//
// Why culling is exact and not approximate: a ball is in a node's list if range().near <= limit.
// The coordinates of all points of a node lie between those of its two corner points (origin + cell
// * e rounds monotonically), and subtraction, product and fma round monotonically too, so no q
// computed at a point in the node is below the computed range().near (falloff.h). A ball left out
// therefore contributes exactly 0 at each point of the node, on its border as well, and at each
// point between two of them. Where coordinates overflow, q is not a number and contributes 0 too.
#pragma once

#include <cstdint>

#include "falloff.h"
#include "far_field.h"
#include "host_device.h"
#include "types.h"
#include "view.h"

namespace polymorph {

constexpr int kBrickCells = 7;                 ///< along an axis
constexpr int kBrickPoints = kBrickCells + 1;  ///< along an axis, both borders included
constexpr int kBranching = 4;                  ///< children along an axis
constexpr int kChildren = kBranching * kBranching * kBranching;
constexpr int kMaxLevels = 12;

/// One level of the tree: nodes along each axis, cells along a node's edge.
struct Level {
  Int3 nodes;
  int cells = kBrickCells;
  int margin = 0;  ///< cells around a node from which its values come
  /// Constants for infinite support: near balls have near^3 <= reach |w|, distant ones an error of
  /// at most truncation |w| / near^3 (far_field.h).
  float reach = 0, truncation = 0;
};

/// Sets which balls a level takes for distant: those whose polynomial errs by less than
/// kFarTolerance iso per cell that FieldScale::length has. `cell` is in units of that length.
inline void set_reach(Level& level, float cell, float iso) {
  const float half = cell * static_cast<float>(level.cells + 2 * level.margin) / 2;
  // Beyond these, boxes reach to the largest distance, and all balls are near (is_near).
  level.truncation = min(kFarError * (half * half) * (half * half), 1e30f);
  level.reach = min(level.truncation / (kFarTolerance * iso * cell), 1e30f);
}

struct Node {
  std::int64_t begin = 0;         ///< first entry of its ball list
  std::uint64_t children = 0;     ///< bit x + 4 (y + 4 z): that child is kept
  std::uint32_t count = 0;        ///< entries
  std::uint32_t first_child = 0;  ///< number of the first kept child, in the next lower level
  std::uint32_t parent = 0;       ///< its number, in the next higher level
  Int3 at;                        ///< among the nodes of its level
};

/// Two counts that are summed together: of nodes and their entries, or of vertices and triangles.
struct Counts {
  std::uint32_t first = 0, second = 0;
};
struct Offsets {
  std::int64_t first = 0, second = 0;
};
PM_HD constexpr Offsets operator+(Offsets a, Offsets b) {
  return {a.first + b.first, a.second + b.second};
}

/// Position of child number `child` of a parent among the nodes of its own level.
PM_HD inline Int3 child_position(Int3 parent, int child) {
  return {parent.x * kBranching + child % kBranching,
          parent.y * kBranching + child / kBranching % kBranching,
          parent.z * kBranching + child / kBranching / kBranching};
}
PM_HD inline int child_number(Int3 at) {
  return at.x % kBranching + kBranching * (at.y % kBranching + kBranching * (at.z % kBranching));
}
PM_HD inline std::uint64_t bits_below(int bit) { return (std::uint64_t{1} << bit) - 1; }

/// The grid points of a node, and whether rim points belong to it.
struct NodeBox {
  Vec3 low, high;
  bool has_rim = false;
};

/// The box of the points from which a node's values come: the node and `margin` cells around it, at
/// least one cell wide, so that a polynomial is defined.
PM_HD inline NodeBox node_box(const Grid& grid, int cells, int margin, Int3 p) {
  const Int3 first = {p.x * cells - 1, p.y * cells - 1, p.z * cells - 1};
  const Int3 last = {first.x + cells, first.y + cells, first.z + cells};
  const Int3 n = grid.points;
  Int3 low = {first.x < 0 ? 0 : first.x, first.y < 0 ? 0 : first.y, first.z < 0 ? 0 : first.z};
  const Int3 high = {last.x >= n.x ? n.x - 1 : last.x, last.y >= n.y ? n.y - 1 : last.y,
                     last.z >= n.z ? n.z - 1 : last.z};
  NodeBox box;
  box.high = grid_point(grid, {high.x + margin, high.y + margin, high.z + margin});
  box.has_rim = low.x != first.x || low.y != first.y || low.z != first.z || high.x != last.x ||
                high.y != last.y || high.z != last.z;
  low = {low.x < high.x ? low.x : high.x - 1, low.y < high.y ? low.y : high.y - 1,
         low.z < high.z ? low.z : high.z - 1};
  box.low = grid_point(grid, {low.x - margin, low.y - margin, low.z - margin});
  return box;
}
PM_HD inline FarBox far_box(const Grid& grid, int cells, int margin, Int3 p) {
  const NodeBox box = node_box(grid, cells, margin, p);
  return {box.low, box.high};
}

/// The boxes of as many neighbouring children as V has lanes.
template <class V>
struct ChildBoxes {
  CoordinateRange<V> range;
  std::uint32_t exist = 0;  ///< bit l: child `first + l` is in the lattice
  std::uint32_t rim = 0;    ///< bit l: it has rim points

  PM_HD ChildBoxes(const Grid& grid, const Level& level, Int3 parent, int first) {
    constexpr int kLanes = Lanes<V>::kCount;
    alignas(32) float c[6][kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const Int3 p = child_position(parent, first + l);
      const NodeBox box = node_box(grid, level.cells, level.margin, p);
      c[0][l] = box.low.x, c[1][l] = box.high.x, c[2][l] = box.low.y;
      c[3][l] = box.high.y, c[4][l] = box.low.z, c[5][l] = box.high.z;
      const bool in = p.x < level.nodes.x && p.y < level.nodes.y && p.z < level.nodes.z;
      exist |= (in ? 1u : 0u) << l;
      rim |= (box.has_rim ? 1u : 0u) << l;
    }
    range = {Lanes<V>::load(c[0]), Lanes<V>::load(c[1]), Lanes<V>::load(c[2]),
             Lanes<V>::load(c[3]), Lanes<V>::load(c[4]), Lanes<V>::load(c[5])};
  }
};

/// Bounds of a sum of w / q over boxes from its value and slope in their middles. Taylor's theorem,
/// with 6 |w| / q^2 the largest second derivative at squared distance q: |f(x) - f(c) - f'(c) (x -
/// c)| <= 3 |w| |x - c|^2 / near^2. For a ball whose nearest and furthest values bound it more
/// tightly, these are used.
template <class V>
struct GradientBounds {
  V x, y, z, half_x, half_y, half_z;  ///< the middles, and half the sides
  V middle, gx, gy, gz, error;

  PM_HD explicit GradientBounds(const CoordinateRange<V>& b)
      : x(0.5f * (b.low_x + b.high_x)),
        y(0.5f * (b.low_y + b.high_y)),
        z(0.5f * (b.low_z + b.high_z)),
        half_x(0.500001f * (b.high_x - b.low_x)),
        half_y(0.500001f * (b.high_y - b.low_y)),
        half_z(0.500001f * (b.high_z - b.low_z)),
        middle(broadcast<V>(0.0f)),
        gx(middle),
        gy(middle),
        gz(middle),
        error(middle) {}

  PM_HD void add(const RoundBall& ball, V near, V at_near, V at_far) {
    const V dx = ball.scale * (x - ball.x), dy = ball.scale * (y - ball.y),
            dz = ball.scale * (z - ball.z);
    const V inverse = 1.0f / fma(dx, dx, fma(dy, dy, fma(dz, dz, broadcast<V>(ball.base))));
    const V derivative = (-2.0f * ball.w * ball.scale) * (inverse * inverse);
    const V reach2 = ball.scale_squared * fma(half_x, half_x, fma(half_y, half_y, half_z * half_z));
    const V curvature_bound = 3.00001f * (ball.w < 0 ? -ball.w : ball.w) * (reach2 / (near * near));
    const V width = 0.5f * (at_near - at_far), half = max(width, -width);
    const auto smooth = curvature_bound < half;
    middle = middle + select(smooth, ball.w * inverse, 0.5f * (at_near + at_far));
    error = error + select(smooth, curvature_bound, half);
    gx = gx + zero_unless(smooth, derivative * dx);
    gy = gy + zero_unless(smooth, derivative * dy);
    gz = gz + zero_unless(smooth, derivative * dz);
  }

  /// Tightens the bounds given, and adds the polynomial of the distant balls to them.
  template <class Team>
  PM_HD void refine_bounds(const Team& team, const FarField& far, const FarBox& box, V& lower,
                           V& upper) {
    middle = team.group_sum(middle), error = team.group_sum(error);
    gx = team.group_sum(gx), gy = team.group_sum(gy), gz = team.group_sum(gz);
    const FarSlope<V> beyond(far.value, box, x, y, z);
    const V reach2 = fma(half_x, half_x, fma(half_y, half_y, half_z * half_z));
    // The polynomial's slope is off by at most 8.2 error / half a side along each axis: Shadrin
    // 1995 for the slope of an interpolation, and the sum of all |slope|, which is 12.3.
    const V slack = fma(reach2, broadcast<V>(far.second_derivative_bound),
                        broadcast<V>(26 * (far.error + far.rounding)));
    const V swing_beyond = swing(beyond.x, beyond.y, beyond.z) + slack;
    const V swing_all = swing(gx + beyond.x, gy + beyond.y, gz + beyond.z) + (error + slack);
    lower = beyond.value + max(lower - swing_beyond, middle - swing_all);
    upper = beyond.value + min(upper + swing_beyond, middle + swing_all);
  }
  PM_HD V swing(V sx, V sy, V sz) const {
    return fma(max(sx, -sx), half_x, fma(max(sy, -sy), half_y, max(sz, -sz) * half_z));
  }
};

/// Finds the children of a node that the surface can cross, and counts the balls that reach each.
/// Team::kParts teams share a node: near the roots there are few nodes, and each has a long list.
template <class F>
struct ClassifyChildren {
  static constexpr int kThreads = 512;
  struct Scratch {};
  Grid grid;
  float iso = 1;
  Level level;  ///< the children's
  View<Node> parents;
  View<const std::uint32_t> entries;
  View<const typename F::Ball> balls;
  View<std::uint32_t> child_entries;  ///< per child of each parent: 1 + its balls; 0 = dropped
  View<Counts> sums;                  ///< per parent: children kept, their balls; 0 before
  View<const FarField> far;           ///< per parent, where support is infinite

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch&, std::int64_t item) const {
    using V = typename Team::V;
    constexpr int kEach = kChildren / Team::kParts;
    const std::int64_t p = item / Team::kParts;
    const int begin = static_cast<int>(item % Team::kParts) * kEach;
    const Node parent = parents[p];
    team.each_group(kEach / Lanes<V>::kCount, [&](int g) {
      const int first = begin + g * Lanes<V>::kCount;
      const ChildBoxes<V> boxes(grid, level, parent.at, first);
      std::uint32_t keep = 0;
      V reached = broadcast<V>(0.0f);
      if (boxes.exist != 0) keep = classify<V>(team, p, boxes, reached);
      if (!team.leads_group()) return;
      alignas(32) float count[Lanes<V>::kCount];
      Lanes<V>::store(count, reached);
      std::uint32_t sum = 0;
      for (int l = 0; l < Lanes<V>::kCount; ++l) {
        const std::uint32_t balls_kept = keep >> l & 1u ? static_cast<std::uint32_t>(count[l]) : 0;
        child_entries[p * kChildren + first + l] = balls_kept + (keep >> l & 1u);
        sum += balls_kept;
      }
      if (keep == 0) return;
      team.add(parents[p].children, std::uint64_t{keep} << first);
      team.add(sums[p].first, static_cast<std::uint32_t>(popcount(keep)));
      team.add(sums[p].second, sum);
    });
  }

  /// Bounds of the field over each box: each ball at its nearest and its furthest; a ball of
  /// infinite support also by its slope in the middle, which cancels between balls on different
  /// sides.
  template <class V, class Team>
  PM_HD std::uint32_t classify(const Team& team, std::int64_t p, const ChildBoxes<V>& boxes,
                               V& reached) const {
    const Node parent = parents[p];
    V lower = broadcast<V>(0.0f), upper = lower, magnitude = lower, count = lower;
    GradientBounds<V> gradient_bounds(boxes.range);
    PM_UNROLL  // loads balls ahead of their use
        for (std::uint32_t j = team.group_rank(); j < parent.count; j += team.kGroup) {
      const typename F::Ball ball = balls[entries[parent.begin + j]];
      const QRange<V> q = ball.range(boxes.range);
      const V at_near = F::value(ball, q.near), at_far = F::value(ball, q.far);
      lower = lower + min(at_near, at_far);
      upper = upper + max(at_near, at_far);
      magnitude = magnitude + max(at_near, -at_near);
      count = count + zero_unless(F::reaches(ball, q, level.reach), broadcast<V>(1.0f));
      if constexpr (!F::kCompactSupport) gradient_bounds.add(ball, q.near, at_near, at_far);
    }
    lower = team.group_sum(lower), upper = team.group_sum(upper);
    magnitude = team.group_sum(magnitude), reached = team.group_sum(count);
    // A sum can exceed its bound by the rounding of both, and twice the error of exp2().
    auto terms = static_cast<float>(parent.count);
    if constexpr (!F::kCompactSupport) {
      const FarBox box = far_box(grid, kBranching * level.cells, level.margin, parent.at);
      gradient_bounds.refine_bounds(team, far[p], box, lower, upper);
      magnitude = magnitude + far[p].size;
      terms = static_cast<float>(balls.size);
    }
    const V slack = magnitude * (2e-6f + 2.5e-7f * terms);
    const std::uint32_t outside = Lanes<V>::bits(upper + slack <= iso);
    const std::uint32_t inside = Lanes<V>::bits(lower - slack > iso) & ~boxes.rim;
    return boxes.exist & ~outside & ~inside;
  }
};

/// Writes the kept children of a node with their ball lists. Teams share a node as in
/// ClassifyChildren.
template <class F>
struct FillChildren {
  static constexpr int kThreads = 512;
  static constexpr std::uint32_t kAhead = 4;  ///< balls loaded ahead of their use
  struct Scratch {
    std::uint32_t begin[kChildren + 1];  ///< per child: begin of its list, from the node's first
  };
  Grid grid;
  Level level;  ///< the children's
  View<Node> parents;
  View<const std::uint32_t> entries;
  View<const typename F::Ball> balls;
  View<const std::uint32_t> child_entries;
  View<const Offsets> first;  ///< per parent: its first child and entry
  View<Node> nodes;
  View<Counts> sums;  ///< per node, for ClassifyChildren to add to; none for bricks
  View<std::uint32_t> node_entries;

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t item) const {
    using V = typename Team::V;
    constexpr int kEach = kChildren / Team::kParts;
    const std::int64_t p = item / Team::kParts;
    const int from = static_cast<int>(item % Team::kParts) * kEach;
    const Node parent = parents[p];
    const Offsets start = first[p];
    team.each(kChildren, [&](int c) {
      scratch.begin[c] = parent.children >> c & 1u ? child_entries[p * kChildren + c] - 1 : 0;
    });
    team.each(1, [&](int) {  // the other parts do not read it
      if (from == 0) parents[p].first_child = static_cast<std::uint32_t>(start.first);
    });
    team.sync();
    team.scan(scratch.begin, kChildren);
    team.each(kEach, [&](int i) {
      const int c = from + i;
      if (!(parent.children >> c & 1u)) return;
      const std::int64_t slot = start.first + popcount(parent.children & bits_below(c));
      if (slot >= nodes.size) return;
      Node node;
      node.at = child_position(parent.at, c);
      node.parent = static_cast<std::uint32_t>(p);
      node.begin = start.second + scratch.begin[c];
      node.count = scratch.begin[c + 1] - scratch.begin[c];
      // Beyond the capacity: the pass runs again with more memory.
      if (node.begin + node.count > node_entries.size) node.count = 0;
      nodes[slot] = node;
      if (slot < sums.size) sums[slot] = {};
    });
    team.each_group(kEach / Lanes<V>::kCount, [&](int g) {
      const int base = from + g * Lanes<V>::kCount;
      const auto kept =
          static_cast<std::uint32_t>(parent.children >> base & bits_below(Lanes<V>::kCount));
      if (kept == 0) return;
      const ChildBoxes<V> boxes(grid, level, parent.at, base);
      std::int64_t cursor[Lanes<V>::kCount];
      for (int l = 0; l < Lanes<V>::kCount; ++l) cursor[l] = start.second + scratch.begin[base + l];
      for (std::uint32_t j0 = 0; j0 < parent.count; j0 += kAhead * team.kGroup) {
        std::uint32_t index[kAhead];
        typename F::Ball ball[kAhead];
        for (std::uint32_t k = 0; k < kAhead; ++k) {
          const std::uint32_t j = j0 + k * team.kGroup + team.group_rank();
          index[k] = entries[parent.begin + (j < parent.count ? j : 0)];
          ball[k] = balls[index[k]];
        }
        for (std::uint32_t k = 0; k < kAhead; ++k) {
          const std::uint32_t j = j0 + k * team.kGroup + team.group_rank();
          const std::uint32_t reached =
              j < parent.count
                  ? kept &
                        Lanes<V>::bits(F::reaches(ball[k], ball[k].range(boxes.range), level.reach))
                  : 0;
          team.append(reached, cursor, [&](std::int64_t slot) {
            if (slot < node_entries.size) node_entries[slot] = index[k];
          });
        }
      }
    });
  }
};

/// The whole tree, for finding bricks by their place.
struct Tree {
  int levels = 0;                      ///< below the roots
  Int3 roots = {1, 1, 1};              ///< along each axis; all of them are there
  View<const Node> nodes[kMaxLevels];  ///< 0: bricks; nodes[levels]: the roots, x first

  /// Number of the brick at `p`, or -1 where none is kept.
  PM_HD std::int64_t find(Int3 p) const {
    const Int3 root = {p.x >> 2 * levels, p.y >> 2 * levels, p.z >> 2 * levels};
    if (p.x < 0 || p.y < 0 || p.z < 0 || root.x >= roots.x || root.y >= roots.y ||
        root.z >= roots.z) {
      return -1;
    }
    return find_below(p, levels, root.x + roots.x * (root.y + roots.y * root.z));
  }

  /// Number of the brick beside brick b, or -1 where none is kept: up to the first node that holds
  /// both, and down.
  PM_HD std::int64_t find_near(std::int64_t b, Int3 offset) const {
    const Int3 at = nodes[0][b].at, p = {at.x + offset.x, at.y + offset.y, at.z + offset.z};
    std::int64_t number = b;
    for (int l = 1; l <= levels; ++l) {
      number = nodes[l - 1][number].parent;
      const Int3 here = nodes[l][number].at;
      if (p.x >> 2 * l == here.x && p.y >> 2 * l == here.y && p.z >> 2 * l == here.z)
        return find_below(p, l, number);
    }
    return find(p);
  }

 private:
  /// Number of the brick at `p` below a node of level `from`.
  PM_HD std::int64_t find_below(Int3 p, int from, std::int64_t number) const {
    for (int l = from; l > 0; --l) {
      const int shift = 2 * (l - 1);
      const Int3 at = {p.x >> shift, p.y >> shift, p.z >> shift};
      const Node& node = nodes[l][number];
      if (at.x >> 2 != node.at.x || at.y >> 2 != node.at.y || at.z >> 2 != node.at.z) return -1;
      const int c = child_number(at);
      if (!(node.children >> c & 1u)) return -1;
      number = node.first_child + popcount(node.children & bits_below(c));
      if (number >= nodes[l - 1].size) return -1;
    }
    return number;
  }
};

}  // namespace polymorph
