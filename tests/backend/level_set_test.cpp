// Passes of a GPU that do at once what a CPU does in several do the same.
#include "kernels/level_set.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "kernels/cpu_backend.h"
#include "kernels/regression.h"
#include "kernels/triangles.h"
#include "testing/bricks.h"

namespace polymorph {
namespace {

TEST(LevelSet, nodes_are_numbered_at_once_as_by_a_scan) {
  std::mt19937 random(3);
  for (const std::int64_t parent_count : {0, 1, 32, 33, 700}) {
    std::vector<Node> parents(static_cast<std::size_t>(parent_count) + 1);
    std::vector<Counts> counts(parents.size());
    std::vector<Offsets> first(parents.size());
    Offsets sum;
    for (std::size_t p = 0; p + 1 < parents.size(); ++p) {
      Node& parent = parents[p];
      parent.at = {static_cast<int>(p), 1, 2};
      parent.children = p % 5 == 0 ? 0 : std::uint64_t{random()} << 32 | random();
      counts[p] = {static_cast<std::uint32_t>(popcount(parent.children)), 0};
      first[p] = sum;
      sum = sum + Offsets{counts[p].a, 0};
    }
    const auto children = static_cast<std::size_t>(sum.nodes());
    std::vector<Node> expected_parents = parents, expected(children), nodes(children);
    std::vector<Counts> zeros(children, Counts{7, 7});
    FillNodes::Scratch fill_scratch;
    const FillNodes fill{view_of(expected_parents), view_of(first), view_of(expected), {}};
    for (std::int64_t p = 0; p < parent_count; ++p) fill(CpuTeam<float>{}, fill_scratch, p);
    Offsets total = {7, 7};
    const NumberNodes number{&parent_count,  view_of(parents), view_of(counts),
                             view_of(nodes), view_of(zeros),   &total};
    const auto scratch = std::make_unique<NumberNodes::Scratch>();
    // One team more than there are parents for, because buffers have room for more.
    for (std::int64_t t = 0; t < parent_count / NumberNodes::kParents + 2; ++t)
      number(CpuTeam<float>{}, *scratch, t);
    EXPECT_EQ(total.nodes(), sum.nodes());
    EXPECT_EQ(total.entries(), 0);
    for (std::size_t p = 0; p < parents.size(); ++p)
      EXPECT_EQ(parents[p].first_child, expected_parents[p].first_child) << p;
    for (std::size_t c = 0; c < children; ++c) {
      EXPECT_EQ(nodes[c].parent, expected[c].parent) << c;
      EXPECT_EQ(nodes[c].at.x, expected[c].at.x) << c;
      EXPECT_EQ(nodes[c].at.y, expected[c].at.y) << c;
      EXPECT_EQ(nodes[c].at.z, expected[c].at.z) << c;
      EXPECT_EQ(zeros[c].nodes(), 0u) << c;
    }
  }
}

TEST(LevelSet, nodes_that_do_not_fit_are_counted_but_not_written) {
  constexpr std::int64_t kParentCount = 40;
  std::vector<Node> parents(kParentCount), nodes(100);
  std::vector<Counts> counts(kParentCount, Counts{3, 0}), node_counts(2, Counts{7, 7});
  for (Node& parent : parents) parent.children = 7;
  for (Node& node : nodes) node.parent = 1234;
  Offsets total;
  // Of 40 parents 39 fit, of their 117 children 99, and of the children's counts one.
  NumberNodes number{&kParentCount,  view_of(parents),     view_of(counts),
                     view_of(nodes), view_of(node_counts), &total};
  number.parent_counts.size = 39;
  number.nodes.size = 99;
  number.counts.size = 1;
  const auto scratch = std::make_unique<NumberNodes::Scratch>();
  for (std::int64_t t = 0; t < 2; ++t) number(CpuTeam<float>{}, *scratch, t);
  EXPECT_EQ(total.nodes(), 117);
  EXPECT_EQ(nodes[98].parent, 32u);
  EXPECT_EQ(nodes[99].parent, 1234u);
  EXPECT_EQ(node_counts[0].nodes(), 0u);
  EXPECT_EQ(node_counts[1].nodes(), 7u);
}

/// A team that takes a GPU's way through EmitTriangles.
struct ListingTeam : CpuTeam<float> {
  static constexpr std::uint32_t kGroup = 2;
};

TEST(LevelSet, triangles_are_the_same_listed_or_not) {
  std::mt19937 random(5);
  BrickBuffers buffers;
  buffers.bricks.resize(1);
  // One in so many points is inside. Of every point the triangles are too many for the list.
  for (const unsigned rarity : {2u, 9u}) {
    const CountBricks count = buffers.counting({{0, 0, 0}, 1, {8, 8, 8}}, /*outside=*/-1);
    std::vector<Offsets> first(1);
    CountBricks::Scratch count_scratch;
    for (int i = 0; i < kBrickValues; ++i) {
      // No edge of the last points, which are other bricks', is crossed.
      const int x = i % kBrickPoints, y = i / kBrickPoints % kBrickPoints, z = i / kLines;
      const bool is_last = x == kBrickCells || y == kBrickCells || z == kBrickCells;
      count_scratch.values[i] = !is_last && random() % rarity == 0 ? 1.0f : -1.0f;
    }
    count.count(CpuTeam<float>{}, count_scratch, 0, {0, 0, 0});
    ASSERT_EQ(buffers.counts[0].triangles() > EmitTriangles::kListed, rarity == 2);
    std::vector<Triangle> triangles(buffers.counts[0].triangles()), listed(triangles.size());
    EmitTriangles emit;
    emit.table = view_of(buffers.table);
    emit.tree.nodes[0] = view_of(buffers.bricks);
    emit.inside = view_of(buffers.inside);
    emit.rows = view_of(buffers.rows);
    emit.counts = view_of(buffers.counts);
    emit.first = view_of(first);
    emit.capacity = 1;
    emit.triangles = view_of(triangles);
    const auto scratch = std::make_unique<EmitTriangles::Scratch>();
    emit(CpuTeam<float>{}, *scratch, 0);
    emit.triangles = view_of(listed);
    emit(ListingTeam{}, *scratch, 0);
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (int v = 0; v < 3; ++v) {
        EXPECT_EQ(listed[t].v[v], triangles[t].v[v]) << t;
        EXPECT_LT(listed[t].v[v], buffers.counts[0].vertices()) << t;
      }
  }
}

TEST(LevelSet, strain_is_maximized_at_once_as_axis_by_axis) {
  constexpr int kFloats = MaximizeStrain<float>::kFloats;
  const Int3 n = {9, 6, 7};
  const int row = n.x, layer = n.x * n.y, nodes = layer * n.z;
  std::mt19937 random(4);
  std::vector<Quadruple> coefficients(static_cast<std::size_t>(kQuadruples * nodes));
  for (Quadruple& quadruple : coefficients)
    for (float& v : quadruple.v) v = static_cast<float>(random() >> 8) * 0x1p-24f;
  const auto padded = static_cast<std::size_t>(nodes + MaximizeStrain<float>::kPadding);
  std::vector<Strain> strain(padded), windows(padded), at_once(padded);
  BoundStrain bound;
  bound.lattice = {{0, 0, 0}, 0.3f, n};
  bound.nodes = {coefficients[0].v, std::int64_t{kRegressionValues} * nodes};
  bound.scale[1] = 1.5f;
  bound.strain = {strain.data(), nodes};
  for (int i = 0; i < nodes; ++i) bound(i);
  for (const int step : {1, row, layer}) {
    const MaximizeStrain<float> maximize{&strain[0].maps.x, &windows[0].maps.x, kFloats * nodes,
                                         kFloats * step};
    for (int i = 0; i < kFloats * nodes; ++i) maximize(i);
    strain.swap(windows);
  }
  bound.strain = {at_once.data(), nodes};
  const auto scratch = std::make_unique<BoundStrainWindows::Scratch>();
  const BoundStrainWindows pass{bound, {3, 2, 2}};
  for (int tile = 0; tile < 3 * 2 * 2; ++tile) pass(CpuTeam<float>{}, *scratch, tile);
  // Windows beyond the lattice's end are undefined.
  for (int z = 0; z + kStrainWindow <= n.z; ++z)
    for (int y = 0; y + kStrainWindow <= n.y; ++y)
      for (int x = 0; x + kStrainWindow <= n.x; ++x) {
        const auto at = static_cast<std::size_t>(x + row * y + layer * z);
        for (int k = 0; k < kFloats; ++k)
          EXPECT_EQ((&at_once[at].maps.x)[k], (&strain[at].maps.x)[k]) << at << ' ' << k;
      }
}

}  // namespace
}  // namespace polymorph
