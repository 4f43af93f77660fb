// Level sets of fields that can be evaluated anywhere: an object's distances (distance_field.h) and
// the field between two objects (morph_field.h). Passes find the bricks (tree.h) that the surface
// can cross and sample the field in them; LevelSetVertices is the Source of PlaceVertices. The
// surface is where the field is 0; the field is positive inside.
//
// A field has, for V = float or a pack of floats,
//   value(p), negated_gradient(p): the field and minus its gradient at Points<V>
//   BrickValues<float>(team, scratch, field, grid, first): evaluates value() at the points of the
//     brick whose lowest grid point is `first`; its call operator takes the index of a point. The
//     team's threads share `scratch`, a BrickScratch
//   PackBox(scratch, field, points), for packs: evaluates value() at some of the BoxPoints
//     (field.h). add_lines(bits) prepares the lines of points (y, z) that have bit y + 8 z; then
//     value<V>(indices) evaluates a pack of their points
//   prefetch(grid, first), for packs: prefetches the distances that value() reads at the points of
//     the brick
// The bounds of a field have
//   local(team, box): a Local, which holds the bounds that are valid in all of a node's box
//   crossing_boxes(middles, half, local, has_rim): a mask of lanes. Bit l is set if the surface can
//     cross the box of half sides `half` around middle l. With has_rim it is set if a point of that
//     box can be inside, because the rim around the grid is outside (tree.h)
//   sides<V>(box, middles, half, local), for packs: the Sides on which boxes around points of a
//     PackBox can have points
// If kHasHalves is true, both also have half(o), o = 0 or 1: an object with the same functions for
// float, which two neighbouring threads of a GPU call together (MorphField::Half).
#pragma once

#include <cstdint>
#include <type_traits>

#include "bricks.h"
#include "field.h"
#include "host_device.h"
#include "tree.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// Finds the children of a node that the surface can cross, and marks them in Node::children.
/// Team::kParts teams share a node, as in ClassifyChildren (tree.h).
template <class Bounds>
struct ClassifyNodes {
  static constexpr int kThreads = 128, kMinTeams = 8;
  struct Scratch {
    /// Per child of a team: the bounds in its box, and whether the surface can cross that box.
    typename Bounds::Local local[kChildren];
    bool crosses[kChildren];
    /// If two threads share a box: the children that the surface can cross. Their elements of
    /// `local` have the same order.
    int crossed[kChildren], crossed_count;
  };
  Grid grid;
  Bounds bounds;
  Level level;  ///< the children's
  View<Node> parents;
  View<Counts> counts;  ///< per parent, 0 before this pass: becomes the number of kept children

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t item) const {
    constexpr int kChildrenPerTeam = kChildren / Team::kParts;
    const std::int64_t p = item / Team::kParts;
    const auto part = static_cast<int>(item % Team::kParts);
    const Node parent = parents[p];
    // A group tests a child's blocks, because few children are left.
    const auto keep_child = [&](int child, const typename Bounds::Local& local) {
      const bool keep = level.cells > kBrickCells ||
                        can_cross_blocks(team, child_position(parent.at, child), local);
      if (!keep || !team.leads_group()) return;
      team.add(parents[p].children, std::uint64_t{1} << child);
      team.add(counts[p].nodes(), 1u);
    };
    if constexpr (kHalves<Team, Bounds>) {
      static_assert(2 * kChildrenPerTeam == Team::kGroup && Team::kParts == kBranching);
      // Two neighbouring threads of the first group test a child together, each by one object.
      team.each(2 * kChildrenPerTeam, [&](int thread) {
        const int child = child_of_part(part, thread / 2);
        const Int3 at = child_position(parent.at, child);
        typename Bounds::Local local;
        const bool crosses = can_cross(team, bounds.half(thread % 2), at, local) && exists(at);
        std::int64_t count = 0;
        team.append(crosses && thread % 2 == 0 ? 1u : 0u, &count, [&](std::int64_t slot) {
          scratch.crossed[slot] = child;
          scratch.local[slot] = local;
        });
        scratch.crossed_count = static_cast<int>(count);
      });
      team.sync();
      team.each_group(scratch.crossed_count,
                      [&](int i) { keep_child(scratch.crossed[i], scratch.local[i]); });
    } else {
      const int begin = part * kChildrenPerTeam;
      std::uint64_t candidates = ~std::uint64_t{0};
      // A CPU tests children a pack at a time before it tests each alone. A GPU's threads test many
      // children at once anyway.
      if constexpr (Lanes<typename Team::V>::kCount > 1)
        candidates = find_candidates(team, parent.at);
      team.each(kChildrenPerTeam, [&](int i) {
        const Int3 at = child_position(parent.at, begin + i);
        const bool is_candidate = (candidates >> (begin + i) & 1u) != 0 && exists(at);
        scratch.crosses[i] = is_candidate && can_cross(team, bounds, at, scratch.local[i]);
      });
      team.sync();
      team.each_group(kChildrenPerTeam, [&](int i) {
        if (scratch.crosses[i]) keep_child(begin + i, scratch.local[i]);
      });
    }
  }

 private:
  /// Returns child i of the 16 children that a team tests. A surface that is nearly a plane crosses
  /// about as many children of each part, whatever its direction.
  PM_HD static int child_of_part(int part, int i) {
    const int y = i % kBranching, z = i / kBranching, x = (part + 2 * y + z) % kBranching;
    return x + kBranching * (y + kBranching * z);
  }
  PM_HD bool exists(Int3 at) const {
    return at.x < level.nodes.x && at.y < level.nodes.y && at.z < level.nodes.z;
  }

  /// Tests a pack of children at a time with the bounds that are valid in their parent's box.
  /// Returns a mask whose bit c is set if the surface can cross child c by these bounds.
  template <class Team>
  PM_HD std::uint64_t find_candidates(const Team& team, Int3 parent) const {
    using V = typename Team::V;
    constexpr int kLanes = Lanes<V>::kCount;
    const typename Bounds::Local local =
        bounds.local(team, node_box(grid, level.cells * kBranching, /*margin=*/0, parent));
    std::uint64_t candidates = 0;
    for (int begin = 0; begin < kChildren; begin += kLanes) {
      alignas(64) float x[kLanes], y[kLanes], z[kLanes];
      Vec3 half;  // of the largest box of the pack; boxes at the grid's border are smaller
      bool has_rim = false;
      for (int l = 0; l < kLanes; ++l) {
        const Int3 at = child_position(parent, begin + l);
        // A child beyond the tree's last cell takes the box of an existing one. operator() drops
        // it.
        const Int3 n = level.nodes;
        const NodeBox box = node_box(grid, level.cells, /*margin=*/0,
                                     {at.x < n.x ? at.x : n.x - 1, at.y < n.y ? at.y : n.y - 1,
                                      at.z < n.z ? at.z : n.z - 1});
        const Vec3 half_of_box = 0.5f * (box.high - box.low), middle = box.low + half_of_box;
        half = max(half, half_of_box);
        has_rim = has_rim || box.has_rim;
        x[l] = middle.x, y[l] = middle.y, z[l] = middle.z;
      }
      const Points<V> middles = {Lanes<V>::load(x), Lanes<V>::load(y), Lanes<V>::load(z)};
      const std::uint64_t bits = bounds.crossing_boxes(middles, half, local, has_rim);
      candidates |= bits << begin;
    }
    return candidates;
  }

  /// Tests one child with the bounds of its own box, which it stores in `local`.
  /// `tested`: the bounds, or the half of this thread.
  template <class Team, class Tested>
  PM_HD bool can_cross(const Team& team, const Tested& tested, Int3 at,
                       typename Bounds::Local& local) const {
    const NodeBox box = node_box(grid, level.cells, /*margin=*/0, at);
    const Vec3 half = 0.5f * (box.high - box.low), middle = box.low + half;
    local = tested.local(team, box);
    return tested.crossing_boxes(Points<float>{middle.x, middle.y, middle.z}, half, local,
                                 box.has_rim) != 0;
  }

  /// Tests whether the surface can cross any of the equal blocks of a brick. Blocks have
  /// tighter bounds than the whole brick, so that fewer bricks are sampled. Returns true for packs,
  /// which test blocks when they sample a brick (SampleBlocks).
  template <class Team>
  PM_HD bool can_cross_blocks(const Team& team, Int3 at,
                              const typename Bounds::Local& local) const {
    using V = typename Team::V;
    if constexpr (Lanes<V>::kCount > 1) return true;
    const NodeBox box = node_box(grid, level.cells, /*margin=*/0, at);
    // With 3^3 blocks a GPU samples more bricks, but in less time than 4^3 blocks take to test.
    constexpr int kBlocksAlongAxis = kHalves<Team, Bounds> ? 3 : 4,
                  kBlocks = kBlocksAlongAxis * kBlocksAlongAxis * kBlocksAlongAxis,
                  kLanes = Lanes<V>::kCount;
    const Vec3 size = (1.0f / kBlocksAlongAxis) * (box.high - box.low);
    const auto middles = [&](int first_block) {
      alignas(64) float x[kLanes], y[kLanes], z[kLanes];
      for (int l = 0; l < kLanes; ++l) {
        const int block = first_block + l;
        x[l] = box.low.x + size.x * (0.5f + static_cast<float>(block % kBlocksAlongAxis));
        y[l] = box.low.y +
               size.y * (0.5f + static_cast<float>(block / kBlocksAlongAxis % kBlocksAlongAxis));
        z[l] = box.low.z +
               size.z * (0.5f + static_cast<float>(block / (kBlocksAlongAxis * kBlocksAlongAxis)));
      }
      return Points<V>{Lanes<V>::load(x), Lanes<V>::load(y), Lanes<V>::load(z)};
    };
    const auto rank = static_cast<int>(team.group_rank()), threads = static_cast<int>(team.kGroup);
    float any = 0;  // 0 or 1, as a float for group_max()
    if constexpr (kHalves<Team, Bounds>) {
      const auto tested = bounds.half(rank % 2);
      for (int begin = 0; begin < kBlocks && any == 0; begin += threads / 2) {
        const int block = begin + rank / 2 < kBlocks ? begin + rank / 2 : kBlocks - 1;
        if (tested.crossing_boxes(middles(block), 0.5f * size, local, box.has_rim) != 0) any = 1;
        any = team.group_max(any);  // the whole group ends the loop together
      }
    } else {
      for (int i = rank; i < kBlocks / kLanes && any == 0; i += threads) {
        if (bounds.crossing_boxes(middles(kLanes * i), 0.5f * size, local, box.has_rim) != 0)
          any = 1;
      }
    }
    return team.group_max(any) > 0;
  }
};

/// Writes the kept children of a node. One team per node.
struct FillNodes {
  struct Scratch {};
  View<Node> parents;
  View<const Offsets> first_children;  ///< per parent: index of its first kept child
  View<Node> nodes;
  View<Counts> counts;  ///< per node: set to 0 for ClassifyNodes; empty for bricks

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch&, std::int64_t p) const {
    const Node parent = parents[p];
    const std::int64_t start = first_children[p].nodes();
    team.each(1, [&](int) { parents[p].first_child = static_cast<std::uint32_t>(start); });
    team.each(kChildren, [&](int c) {
      if (!(parent.children >> c & 1u)) return;
      const std::int64_t slot = start + popcount(parent.children & bits_below(c));
      if (slot >= nodes.size) return;  // the passes run again with more memory
      Node node;
      node.at = child_position(parent.at, c);
      node.parent = static_cast<std::uint32_t>(p);
      nodes[slot] = node;
      if (slot < counts.size) counts[slot] = {};
    });
  }
};

/// Does at once what a scan and FillNodes do, as a GPU starts one pass sooner than two. Each team
/// sums the counts of all parents before its own: with the thousands of these that a grid of 1024^3
/// points has, that takes less time than a scan starts in. One team per kParents parents.
struct NumberNodes {
  static constexpr int kThreads = 512;
  static constexpr int kParents = 32;
  struct Scratch {
    std::uint32_t sums[kThreads];         ///< counts of the parents before, one sum per thread
    std::uint32_t before[kChildren + 1];  ///< sums of `sums`, then their prefix sums
    /// Per parent of the team.
    std::uint32_t first[kParents + 1];
    std::uint64_t children[kParents];
    Int3 at[kParents];
  };
  const std::int64_t* parent_count = nullptr;
  View<Node> parents;
  View<const Counts> parent_counts;  ///< per parent: the number of its kept children
  View<Node> nodes;
  View<Counts> counts;  ///< per node: set to 0 for ClassifyNodes; empty for bricks
  Offsets* total = nullptr;

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t item) const {
    const std::int64_t count =
        *parent_count < parent_counts.size ? *parent_count : parent_counts.size;
    const std::int64_t begin = kParents * item;
    if (begin >= count && item > 0) return;
    team.each(kThreads, [&](int thread) {
      std::uint32_t sum = 0;
      for (std::int64_t p = thread; p < begin; p += kThreads) sum += parent_counts[p].nodes();
      scratch.sums[thread] = sum;
    });
    team.each(kParents, [&](int i) {
      const bool exists = begin + i < count;
      scratch.first[i] = exists ? parent_counts[begin + i].nodes() : 0;
      scratch.children[i] = exists ? parents[begin + i].children : 0;
      scratch.at[i] = exists ? parents[begin + i].at : Int3{};
    });
    team.sync();
    team.each(kChildren, [&](int i) {
      scratch.before[i] = 0;
      for (int k = i; k < kThreads; k += kChildren) scratch.before[i] += scratch.sums[k];
    });
    team.sync();
    const std::int64_t start = team.scan(scratch.before, kChildren);
    const std::int64_t own = team.scan(scratch.first, kParents);
    team.each(kParents * kChildren, [&](int i) {
      const int p = i / kChildren, c = i % kChildren;
      const std::uint64_t children = scratch.children[p];
      const std::int64_t first = start + scratch.first[p];
      if (c == 0 && begin + p < count)
        parents[begin + p].first_child = static_cast<std::uint32_t>(first);
      if (!(children >> c & 1u)) return;
      const std::int64_t slot = first + popcount(children & bits_below(c));
      if (slot >= nodes.size) return;  // the passes run again with more memory
      Node node;
      node.at = child_position(scratch.at[p], c);
      node.parent = static_cast<std::uint32_t>(begin + p);
      nodes[slot] = node;
      if (slot < counts.size) counts[slot] = {};
    });
    if (begin + kParents >= count) team.each(1, [&](int) { *total = {start + own, 0}; });
  }
};

/// Writes the roots of the tree; one item per root.
struct PrepareNodes {
  Int3 roots;
  View<Node> nodes;
  View<Counts> counts;
  View<Offsets> node_count;  ///< one element: the number of roots

  PM_HD void operator()(std::int64_t i) const {
    if (i >= nodes.size) return;
    const auto root = static_cast<int>(i);
    Node node;
    node.at = {root % roots.x, root / roots.x % roots.y, root / roots.x / roots.y};
    nodes[i] = node;
    counts[i] = {};
    if (i == 0) node_count[0] = {nodes.size, 0};
  }
};

/// Samples the field at each brick's points, one at a time (SampleBlocks: in packs), and counts the
/// brick's vertices and triangles (CountBricks). One team per brick.
template <class Field>
struct SampleLevelSet : CountBricks {
  /// Eight teams on a multiprocessor leave 64 registers to each thread.
  static constexpr int kThreads = 128, kMinTeams = 8;
  struct Scratch : CountBricks::Scratch {
    typename Field::BrickScratch field;
  };
  Field field;

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t item) const {
    using V = typename Team::V;
    constexpr int kLanes = Lanes<V>::kCount;
    const Int3 first = first_point(bricks[begin + item]);
    const typename Field::template BrickValues<V> values_at(team, scratch.field, field, grid,
                                                            first);
    team.each(kBrickValues / kLanes,
              [&](int i) { Lanes<V>::store(scratch.values + kLanes * i, values_at(i)); });
    team.sync();
    count(team, scratch, item, first);
  }
};

/// Source of PlaceVertices (vertices.h) for a level set. All bricks have the same field.
template <class Field>
struct LevelSetVertices {
  /// About as many threads as a brick has vertices, or twice as many where two share one. So many
  /// teams on a multiprocessor leave each thread 128 or 96 registers.
  static constexpr int kThreads = Field::kHasHalves ? 128 : 64,
                       kMinTeams = Field::kHasHalves ? 5 : 8;
  Field field;
  float inv_cell = 1;

  PM_HD const LevelSetVertices& brick_field(const Node&, std::int64_t) const { return *this; }

  template <class V>
  PM_HD V value(const Points<V>& p) const {
    return field.value(p);
  }
  static constexpr bool kHasHalves = Field::kHasHalves;
  PM_HD auto half(int o) const {
    const auto field_half = field.half(o);
    return LevelSetVertices<std::decay_t<decltype(field_half)>>{field_half, inv_cell};
  }
  /// Returns the field's value in cells, which near the surface is nearly the signed distance.
  template <class V>
  PM_HD V height(V value) const {
    return value * inv_cell;
  }
  template <class V>
  PM_HD Points<V> negated_gradient(const Points<V>& p) const {
    return field.negated_gradient(p);
  }
  /// Returns an empty mask. Only sums over balls are replaced by exact ones where the field is flat
  /// (BallVertices, vertices.h).
  template <class V, class Edges>
  PM_HD std::uint32_t flat_lanes(const Edges&, const Points<V>&) const {
    return 0;
  }
  template <class V>
  PM_HD V exact_where(std::uint32_t, V value, const Points<V>&) const {
    return value;
  }
};

}  // namespace polymorph
