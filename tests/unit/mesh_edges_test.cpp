#include "mesh/edges.h"

#include <gtest/gtest.h>

#include "testing/model.h"

namespace polymorph {
namespace {

TEST(Edges, EveryEdgeOfAClosedModelHasTwoUsesInOppositeDirections) {
  const Model box = box_model({0, 0, 0}, {1, 1, 1});
  const std::vector<EdgeUse> uses = sorted_edge_uses(box.triangles);
  EXPECT_EQ(uses.size(), 3 * box.triangles.size());
  std::size_t edges = 0;
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    ++edges;
    ASSERT_EQ(last - first, 2u);
    EXPECT_NE(uses[first].forward, uses[first + 1].forward);
    EXPECT_LT(uses[first].low, uses[first].high);
    EXPECT_LT(uses[first].corner, uses[first + 1].corner);
  });
  EXPECT_EQ(edges, 18u);  // 12 sides and 6 diagonals
}

TEST(Edges, AUseKnowsTheCornersAtItsEnds) {
  const Model box = box_model({0, 0, 0}, {1, 1, 1});
  const auto point_of = [&](std::uint32_t corner) {
    return box.triangles[corner / 3].v[corner % 3];
  };
  for (const EdgeUse& use : sorted_edge_uses(box.triangles)) {
    EXPECT_EQ(point_of(low_corner(use)), use.low);
    EXPECT_EQ(point_of(high_corner(use)), use.high);
    EXPECT_EQ(low_corner(use) / 3, use.corner / 3);
  }
}

TEST(Edges, SidesOfNoLengthAreLeftOut) {
  Model model;
  model.points = {{0, 0, 0}, {1, 0, 0}};
  model.triangles = {{{0, 1, 1}}};
  EXPECT_EQ(sorted_edge_uses(model.triangles).size(), 2u);
}

TEST(Edges, NeighboursLieAcrossTheSidesAndATriangleIsItsOwnWhereThereIsNone) {
  const std::vector<Triangle> pair = {{{0, 1, 2}}, {{2, 1, 3}}};
  const std::vector<Triangle> beside = find_neighbours(pair);
  EXPECT_EQ(beside[0].v[0], 0u);
  EXPECT_EQ(beside[0].v[1], 1u);  // from 1 to 2
  EXPECT_EQ(beside[0].v[2], 0u);
  EXPECT_EQ(beside[1].v[0], 0u);  // from 2 to 1
  EXPECT_EQ(beside[1].v[1], 1u);
}

}  // namespace
}  // namespace polymorph
