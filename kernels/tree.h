// Sparse octree-like tree (branching 4^3) that culls balls: it finds the bricks of cells that the
// surface can cross, each with its list of balls.
//
// The tree covers the lattice: the grid and a rim, one more layer of cells beyond each border. The
// rim's outer points count as outside, so that the surface is closed where the border cuts it.
// Along each axis, lattice point e is grid point e - 1; e = 0 and e = points + 1 are on the rim.
//
// Nodes of level 0 are bricks of 7^3 cells with 8^3 points. A node of level l has 4^3 children of
// level l - 1. The lists of the roots hold all balls. A node keeps those balls of its parent that
// reach it, in the same order, so that no sort is needed, only counting, a scan and filling. With
// infinite support, a ball reaches a node if it is not distant (far_field.h). A child is dropped if
// the field cannot cross iso in it. Nodes of a level are in the order of their parents. A parent
// stores its kept children as 64 bits and the index of the first one, so that a brick is found from
// its position.
//
// Why culling is exact and not approximate: a ball is in a node's list if range().near <= limit.
// The coordinates of all points of a node lie between those of its two corner points (origin + cell
// * e rounds monotonically), and subtraction, product and fma round monotonically too, so no q
// computed at a point in the node is below the computed range().near (falloff.h). A ball outside
// the list therefore contributes exactly 0 at each grid point of the node, its border included, and
// at each position between two grid points. Where coordinates overflow, q is not a number and
// contributes 0 too.
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
constexpr int kBranching = 4;                  ///< children of a node along an axis
constexpr int kChildren = kBranching * kBranching * kBranching;
constexpr int kMaxLevels = 12;

/// One level of the tree: nodes along each axis, cells along a node's edge.
struct Level {
  Int3 nodes;
  int cells = kBrickCells;
  int margin = 0;  ///< a node's values depend on points up to this many cells outside it
  /// Constants for infinite support, where q.near is the minimum of a ball's q in a node: near
  /// balls have q.near^3 <= reach |w|, distant ones an error of at most truncation |w| / q.near^3
  /// (far_field.h).
  float reach = 0, truncation = 0;
};

/// Sets `reach` and `truncation` so that a ball is distant on a level if its error is below
/// kFarTolerance * iso * cell. `cell`: edge of a cell in units of FieldScale::length.
inline void set_reach(Level& level, float cell, float iso) {
  const float half_side = cell * static_cast<float>(level.cells + 2 * level.margin) / 2;
  // Where 1e30 limits the values, boxes extend to the maximum distance, and all balls are near.
  level.truncation = min(kFarError * (half_side * half_side) * (half_side * half_side), 1e30f);
  level.reach = min(level.truncation / (kFarTolerance * iso * cell), 1e30f);
}

struct Node {
  std::int64_t begin = 0;         ///< first entry of its ball list
  std::uint64_t children = 0;     ///< bit x + 4 (y + 4 z): that child is kept
  std::uint32_t count = 0;        ///< number of entries
  std::uint32_t first_child = 0;  ///< index of the first kept child, in the next lower level
  std::uint32_t parent = 0;       ///< index of the parent, in the next higher level
  Int3 at;                        ///< position among the nodes of its level
};

/// Two numbers that one scan sums: of nodes and the entries of their lists, or of vertices and
/// triangles.
template <class T>
struct CountPair {
  T a = 0, b = 0;
  PM_HD constexpr T& nodes() { return a; }
  PM_HD constexpr T& entries() { return b; }
  PM_HD constexpr T& vertices() { return a; }
  PM_HD constexpr T& triangles() { return b; }
  PM_HD constexpr const T& nodes() const { return a; }
  PM_HD constexpr const T& entries() const { return b; }
  PM_HD constexpr const T& vertices() const { return a; }
  PM_HD constexpr const T& triangles() const { return b; }
};
using Counts = CountPair<std::uint32_t>;
using Offsets = CountPair<std::int64_t>;  ///< sums of Counts
PM_HD constexpr Offsets operator+(Offsets x, Offsets y) { return {x.a + y.a, x.b + y.b}; }

/// Returns the lattice's number of cells along each axis: one less than the grid has points, and
/// one more on each side, the rim's.
PM_HD constexpr Int3 lattice_cells(const Grid& grid) {
  return {grid.points.x + 1, grid.points.y + 1, grid.points.z + 1};
}

/// Returns the position of child number `child` of a parent, among the nodes of the child's level.
PM_HD inline Int3 child_position(Int3 parent, int child) {
  return {parent.x * kBranching + child % kBranching,
          parent.y * kBranching + child / kBranching % kBranching,
          parent.z * kBranching + child / kBranching / kBranching};
}
/// Returns the number of the child at `at` among its parent's children.
PM_HD inline int child_number(Int3 at) {
  return at.x % kBranching + kBranching * (at.y % kBranching + kBranching * (at.z % kBranching));
}
PM_HD inline std::uint64_t bits_below(int bit) { return (std::uint64_t{1} << bit) - 1; }

/// The box of a node's grid points (without those of the rim), and whether the node has rim points.
struct NodeBox {
  Vec3 low, high;
  bool has_rim = false;
};

/// The sides of a surface on which boxes, one per lane, can have points: masks of lanes.
struct Sides {
  std::uint32_t inside, outside;
};

/// Returns the box of the points on which the values of the node at `at` depend: the node and
/// `margin` cells around it. It is at least one cell wide, so that a polynomial is defined.
PM_HD inline NodeBox node_box(const Grid& grid, int cells, int margin, Int3 at) {
  const Int3 first = {at.x * cells - 1, at.y * cells - 1, at.z * cells - 1};
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
PM_HD inline FarBox far_box(const Grid& grid, int cells, int margin, Int3 at) {
  const NodeBox box = node_box(grid, cells, margin, at);
  return {box.low, box.high};
}

/// Boxes of as many neighbouring children as V has lanes.
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
      const bool exists = p.x < level.nodes.x && p.y < level.nodes.y && p.z < level.nodes.z;
      exist |= (exists ? 1u : 0u) << l;
      rim |= (box.has_rim ? 1u : 0u) << l;
    }
    range = {Lanes<V>::load(c[0]), Lanes<V>::load(c[1]), Lanes<V>::load(c[2]),
             Lanes<V>::load(c[3]), Lanes<V>::load(c[4]), Lanes<V>::load(c[5])};
  }
};

/// Bounds a sum of terms f = w / q over boxes by the values and gradients in their middles c. The
/// largest second derivative at squared distance q is 6 |w| / q^2, so by Taylor's theorem
///   |f(x) - f(c) - f'(c) (x - c)| <= 3 |w| |x - c|^2 / near^2, near being the minimum of q.
/// If a ball's values at the box's nearest and furthest points give tighter bounds, these are used
/// instead. Factors such as 0.500001 and 3.00001 allow for rounding.
template <class V>
struct GradientBounds {
  V x, y, z, half_x, half_y, half_z;  ///< middles of the boxes, and half their sides
  /// Sums of the values and gradients in the middles, and of the error bounds.
  V middle_value, gx, gy, gz, error;

  PM_HD explicit GradientBounds(const CoordinateRange<V>& b)
      : x(0.5f * (b.low_x + b.high_x)),
        y(0.5f * (b.low_y + b.high_y)),
        z(0.5f * (b.low_z + b.high_z)),
        half_x(0.500001f * (b.high_x - b.low_x)),
        half_y(0.500001f * (b.high_y - b.low_y)),
        half_z(0.500001f * (b.high_z - b.low_z)),
        middle_value(broadcast<V>(0.0f)),
        gx(middle_value),
        gy(middle_value),
        gz(middle_value),
        error(middle_value) {}

  /// Adds a ball whose q is at least `near` in the box, and whose values at the nearest and
  /// furthest points are `at_near` and `at_far`.
  PM_HD void add(const RoundBall& ball, V near, V at_near, V at_far) {
    const V dx = ball.scale * (x - ball.x), dy = ball.scale * (y - ball.y),
            dz = ball.scale * (z - ball.z);
    const V inverse = 1.0f / fma(dx, dx, fma(dy, dy, fma(dz, dz, broadcast<V>(ball.base))));
    const V derivative = (-2.0f * ball.w * ball.scale) * (inverse * inverse);
    const V half_diagonal2 =
        ball.scale_squared * fma(half_x, half_x, fma(half_y, half_y, half_z * half_z));
    const V curvature_bound =
        3.00001f * (ball.w < 0 ? -ball.w : ball.w) * (half_diagonal2 / (near * near));
    const V half_difference = 0.5f * (at_near - at_far),
            half_range = max(half_difference, -half_difference);
    const auto is_taylor_tighter = curvature_bound < half_range;
    middle_value =
        middle_value + select(is_taylor_tighter, ball.w * inverse, 0.5f * (at_near + at_far));
    error = error + select(is_taylor_tighter, curvature_bound, half_range);
    gx = gx + zero_unless(is_taylor_tighter, derivative * dx);
    gy = gy + zero_unless(is_taylor_tighter, derivative * dy);
    gz = gz + zero_unless(is_taylor_tighter, derivative * dz);
  }

  /// Tightens the given bounds of the sum, and adds the polynomial of the distant balls to them.
  template <class Team>
  PM_HD void refine_bounds(const Team& team, const FarField& far, const FarBox& box, V& lower,
                           V& upper) {
    middle_value = team.group_sum(middle_value), error = team.group_sum(error);
    gx = team.group_sum(gx), gy = team.group_sum(gy), gz = team.group_sum(gz);
    const FarSlope<V> far_slope(far.value, box, x, y, z);
    const V half_diagonal2 = fma(half_x, half_x, fma(half_y, half_y, half_z * half_z));
    // The polynomial's slope is off by at most 8.2 error / (half a side) along each axis: Shadrin
    // 1995 gives the error of an interpolant's slope, and the |slope| of the Lagrange polynomials
    // add up to at most 12.3. Over three axes, and with the error of the value, 26 errors suffice.
    const V slack = fma(half_diagonal2, broadcast<V>(far.second_derivative_bound),
                        broadcast<V>(26 * (far.error + far.rounding)));
    const V far_change = max_change(far_slope.x, far_slope.y, far_slope.z) + slack;
    const V total_change =
        max_change(gx + far_slope.x, gy + far_slope.y, gz + far_slope.z) + (error + slack);
    lower = far_slope.value + max(lower - far_change, middle_value - total_change);
    upper = far_slope.value + min(upper + far_change, middle_value + total_change);
  }
  /// Returns the change of a linear function of the given slope from a middle to the furthest
  /// corner.
  PM_HD V max_change(V sx, V sy, V sz) const {
    return fma(max(sx, -sx), half_x, fma(max(sy, -sy), half_y, max(sz, -sz) * half_z));
  }
};

/// Finds the children of a node that the surface can cross, and counts the balls that reach each.
/// Team::kParts teams (backend_engine.h) share a node: near the roots there are few nodes, and each
/// has a long list.
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
  View<std::uint32_t> child_entries;  ///< per child of each parent: 1 + number of balls; 0: dropped
  View<Counts> counts;                ///< per parent: kept children, their balls; 0 at first
  View<const FarField> far;           ///< per parent, where support is infinite

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch&, std::int64_t item) const {
    using V = typename Team::V;
    constexpr int kChildrenPerTeam = kChildren / Team::kParts;
    const std::int64_t p = item / Team::kParts;
    const int begin = static_cast<int>(item % Team::kParts) * kChildrenPerTeam;
    const Node parent = parents[p];
    team.each_group(kChildrenPerTeam / Lanes<V>::kCount, [&](int g) {
      const int first = begin + g * Lanes<V>::kCount;
      const ChildBoxes<V> boxes(grid, level, parent.at, first);
      std::uint32_t keep = 0;
      V ball_counts = broadcast<V>(0.0f);
      if (boxes.exist != 0) keep = classify<V>(team, p, boxes, ball_counts);
      if (!team.leads_group()) return;
      alignas(32) float count[Lanes<V>::kCount];
      Lanes<V>::store(count, ball_counts);
      std::uint32_t sum = 0;
      for (int l = 0; l < Lanes<V>::kCount; ++l) {
        const std::uint32_t ball_count = keep >> l & 1u ? static_cast<std::uint32_t>(count[l]) : 0;
        child_entries[p * kChildren + first + l] = ball_count + (keep >> l & 1u);
        sum += ball_count;
      }
      if (keep == 0) return;
      team.add(parents[p].children, std::uint64_t{keep} << first);
      team.add(counts[p].nodes(), static_cast<std::uint32_t>(popcount(keep)));
      team.add(counts[p].entries(), sum);
    });
  }

  /// Returns a mask of the boxes that the surface can cross, and counts the balls that reach each
  /// box. A ball is bounded by its values at the nearest and furthest points of a box. With
  /// infinite support it is also bounded by its slope in the middle, because slopes of balls on
  /// opposite sides cancel.
  template <class V, class Team>
  PM_HD std::uint32_t classify(const Team& team, std::int64_t p, const ChildBoxes<V>& boxes,
                               V& ball_counts) const {
    const Node parent = parents[p];
    // Bounds of the sum, the sum of the largest absolute values, and the number of balls.
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
    magnitude = team.group_sum(magnitude), ball_counts = team.group_sum(count);
    // A computed sum can exceed its computed bound by the rounding errors of both, and by twice the
    // error of exp2().
    auto term_count = static_cast<float>(parent.count);
    if constexpr (!F::kCompactSupport) {
      const FarBox box = far_box(grid, kBranching * level.cells, level.margin, parent.at);
      gradient_bounds.refine_bounds(team, far[p], box, lower, upper);
      magnitude = magnitude + far[p].magnitude;
      term_count = static_cast<float>(balls.size);
    }
    const V slack = magnitude * (2e-6f + 2.5e-7f * term_count);
    const std::uint32_t outside = Lanes<V>::bits(upper + slack <= iso);
    const std::uint32_t inside = Lanes<V>::bits(lower - slack > iso) & ~boxes.rim;
    return boxes.exist & ~outside & ~inside;
  }
};

/// Writes the kept children of a node with their ball lists. It finds where each list begins,
/// writes the nodes, and then fills the lists. Teams share a node as in ClassifyChildren.
template <class F>
struct FillChildren {
  static constexpr int kThreads = 512;
  static constexpr std::uint32_t kAhead = 4;  ///< balls loaded ahead of their use
  struct Scratch {
    /// Per child: begin of its list, relative to the first entry of the parent's children.
    std::uint32_t begin[kChildren + 1];
  };
  Grid grid;
  Level level;  ///< the children's
  View<Node> parents;
  View<const std::uint32_t> entries;
  View<const typename F::Ball> balls;
  View<const std::uint32_t> child_entries;
  View<const Offsets> first;  ///< per parent: its first child and entry
  View<Node> nodes;
  View<Counts> counts;  ///< per node: set to 0 for ClassifyChildren; empty for bricks
  View<std::uint32_t> node_entries;

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t item) const {
    using V = typename Team::V;
    constexpr int kChildrenPerTeam = kChildren / Team::kParts;
    const std::int64_t p = item / Team::kParts;
    const int begin = static_cast<int>(item % Team::kParts) * kChildrenPerTeam;
    const Node parent = parents[p];
    const Offsets start = first[p];
    team.each(kChildren, [&](int c) {
      scratch.begin[c] = parent.children >> c & 1u ? child_entries[p * kChildren + c] - 1 : 0;
    });
    team.each(1, [&](int) {  // no team of this pass reads first_child
      if (begin == 0) parents[p].first_child = static_cast<std::uint32_t>(start.nodes());
    });
    team.sync();
    team.scan(scratch.begin, kChildren);
    team.each(kChildrenPerTeam, [&](int i) {
      const int c = begin + i;
      if (!(parent.children >> c & 1u)) return;
      const std::int64_t slot = start.nodes() + popcount(parent.children & bits_below(c));
      if (slot >= nodes.size) return;
      Node node;
      node.at = child_position(parent.at, c);
      node.parent = static_cast<std::uint32_t>(p);
      node.begin = start.entries() + scratch.begin[c];
      node.count = scratch.begin[c + 1] - scratch.begin[c];
      // If the list does not fit, all passes run again with more memory.
      if (node.begin + node.count > node_entries.size) node.count = 0;
      nodes[slot] = node;
      if (slot < counts.size) counts[slot] = {};
    });
    team.each_group(kChildrenPerTeam / Lanes<V>::kCount, [&](int g) {
      const int base = begin + g * Lanes<V>::kCount;
      const auto kept_children =
          static_cast<std::uint32_t>(parent.children >> base & bits_below(Lanes<V>::kCount));
      if (kept_children == 0) return;
      const ChildBoxes<V> boxes(grid, level, parent.at, base);
      std::int64_t cursor[Lanes<V>::kCount];
      for (int l = 0; l < Lanes<V>::kCount; ++l)
        cursor[l] = start.entries() + scratch.begin[base + l];
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
          const std::uint32_t reached_children =
              j < parent.count
                  ? kept_children &
                        Lanes<V>::bits(F::reaches(ball[k], ball[k].range(boxes.range), level.reach))
                  : 0;
          team.append(reached_children, cursor, [&](std::int64_t slot) {
            if (slot < node_entries.size) node_entries[slot] = index[k];
          });
        }
      }
    });
  }
};

/// The whole tree, in which bricks are found by position.
struct Tree {
  int levels = 0;                      ///< below the roots
  Int3 roots = {1, 1, 1};              ///< along each axis; none is dropped
  View<const Node> nodes[kMaxLevels];  ///< [0]: bricks; [levels]: the roots, x fastest

  /// Returns the index of the brick at `p`, or -1 if there is none. Its ancestor on level l is at
  /// p / 4^l, which the code writes as p >> 2 l.
  PM_HD std::int64_t find(Int3 p) const {
    const Int3 root = {p.x >> 2 * levels, p.y >> 2 * levels, p.z >> 2 * levels};
    if (p.x < 0 || p.y < 0 || p.z < 0 || root.x >= roots.x || root.y >= roots.y ||
        root.z >= roots.z) {
      return -1;
    }
    return find_below(p, levels, root.x + roots.x * (root.y + roots.y * root.z));
  }

  /// Returns the index of the brick at `offset` from brick b, or -1 if there is none. Goes up to
  /// the first node that contains both bricks, then down.
  PM_HD std::int64_t find_near(std::int64_t b, Int3 offset) const {
    const Int3 at = nodes[0][b].at, p = {at.x + offset.x, at.y + offset.y, at.z + offset.z};
    std::int64_t index = b;
    for (int l = 1; l <= levels; ++l) {
      index = nodes[l - 1][index].parent;
      const Int3 node_position = nodes[l][index].at;
      if (p.x >> 2 * l == node_position.x && p.y >> 2 * l == node_position.y &&
          p.z >> 2 * l == node_position.z)
        return find_below(p, l, index);
    }
    return find(p);
  }

 private:
  /// Returns the index of the brick at `p` below node `index` of level `top_level`, or -1.
  PM_HD std::int64_t find_below(Int3 p, int top_level, std::int64_t index) const {
    for (int l = top_level; l > 0; --l) {
      const int shift = 2 * (l - 1);
      const Int3 at = {p.x >> shift, p.y >> shift, p.z >> shift};
      const Node& node = nodes[l][index];
      if (at.x >> 2 != node.at.x || at.y >> 2 != node.at.y || at.z >> 2 != node.at.z) return -1;
      const int c = child_number(at);
      if (!(node.children >> c & 1u)) return -1;
      index = node.first_child + popcount(node.children & bits_below(c));
      if (index >= nodes[l - 1].size) return -1;
    }
    return index;
  }
};

}  // namespace polymorph
