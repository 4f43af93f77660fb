// Culling is exact: a brick's short list of balls gives the bits of the sum over all balls.
#include "kernels/bricks.h"

#include <gtest/gtest.h>

#include <type_traits>
#include <vector>

#include "backend_fixture.h"
#include "kernels/cells.h"

namespace polymorph {
namespace {

template <class T>
View<T> view_of(std::vector<T>& v) {
  return {v.data(), static_cast<std::int64_t>(v.size())};
}

using RoundGaussian = Field<FieldKind::kGaussian, RoundBall>;
using Ellipsoids = Field<FieldKind::kGaussian, EllipsoidBall>;
using RoundWyvill = Field<FieldKind::kWyvill, RoundBall>;
using WyvillEllipsoids = Field<FieldKind::kWyvill, EllipsoidBall>;
using InverseSquare = Field<FieldKind::kInverseSquare, RoundBall>;

template <class F>
std::vector<Ball> some_balls(int count, unsigned seed) {
  const std::vector<Ball> balls = random_balls(count, F::kKind, seed);
  return std::is_same_v<typename F::Ball, EllipsoidBall> ? squeezed(balls, seed) : balls;
}

/// One step of the tree by hand: the root's children are bricks.
template <class F>
struct OneLevel {
  Grid grid;
  Level level;
  std::vector<typename F::Ball> balls;
  std::vector<std::uint32_t> everyone, counts, slots, entries;
  std::vector<std::uint8_t> active;
  std::vector<std::int64_t> begins;
  std::vector<Node> bricks;
  std::vector<float> values;

  OneLevel(const std::vector<Ball>& raw, const Grid& g, float iso) : grid(g) {
    const Int3 n = g.points;
    level.nodes = {(n.x + 4) / 4, (n.y + 4) / 4, (n.z + 4) / 4};
    std::vector<Ball> copy = raw;
    balls.resize(raw.size());
    everyone.resize(raw.size());
    const PrepareBalls<F> prepare = {view_of(copy), view_of(balls), view_of(everyone),
                                     log_of_two(1e-4f * iso)};
    for (std::size_t i = 0; i < raw.size(); ++i) prepare(static_cast<std::int64_t>(i));
    std::vector<Node> root = {{0, static_cast<std::uint32_t>(raw.size()), 0}};
    active.resize(kChildren);
    counts.resize(kChildren);
    const ClassifyNodes<F, 4> classify = {g,
                                          iso,
                                          level,
                                          {1, 1, 1},
                                          view_of(root),
                                          view_of(everyone),
                                          view_of(balls),
                                          view_of(active),
                                          view_of(counts)};
    for (int i = 0; i < kChildren / 4; ++i) classify(i);
    slots.push_back(0);
    begins.push_back(0);
    for (int i = 0; i < kChildren; ++i) {
      slots.push_back(slots.back() + active[i]);
      begins.push_back(begins.back() + counts[i]);
    }
    bricks.resize(slots.back());
    entries.resize(static_cast<std::size_t>(begins.back()));
    const FillNodes<F> fill = {g,
                               level,
                               {1, 1, 1},
                               view_of(root),
                               view_of(everyone),
                               view_of(balls),
                               view_of(active),
                               view_of(slots),
                               view_of(begins),
                               view_of(bricks),
                               view_of(entries)};
    for (int i = 0; i < kChildren; ++i) fill(i);
    if (!F::kEnds) entries = everyone;
    values.resize(bricks.size() * kBrickStride);
    const SampleBricks<F, 8> sample = {
        grid, level.nodes, view_of(bricks), view_of(entries), view_of(balls), view_of(values)};
    for (std::size_t i = 0; i < values.size() / 8; ++i) sample(static_cast<std::int64_t>(i));
  }

  /// Sum over all balls at one grid point, one lane.
  float brute_force(Int3 point) {
    std::vector<Vec3> at = {grid_point(grid, point)};
    std::vector<float> value(1);
    const BallList all = {everyone.data(), static_cast<std::uint32_t>(everyone.size())};
    SamplePoints<F, 1>{view_of(at), view_of(balls), all, view_of(value)}(0);
    return value[0];
  }

  bool is_rim(Int3 g) const {
    return g.x < 0 || g.y < 0 || g.z < 0 || g.x >= grid.points.x || g.y >= grid.points.y ||
           g.z >= grid.points.z;
  }
};

template <class F>
void expect_exact_bricks(const Grid& grid, int ball_count, unsigned seed) {
  OneLevel<F> tree(some_balls<F>(ball_count, seed), grid, 1.0f);
  ASSERT_FALSE(tree.bricks.empty());
  int checked = 0;
  for (std::size_t b = 0; b < tree.bricks.size(); ++b) {
    const Int3 p = node_position(tree.level.nodes, tree.bricks[b].index);
    for (int i = 0; i < kBrickValues; ++i) {
      const Int3 g = {p.x * kBrickCells + i % kBrickPoints - 1,
                      p.y * kBrickCells + i / kBrickPoints % kBrickPoints - 1,
                      p.z * kBrickCells + i / kBrickPoints / kBrickPoints - 1};
      const float expected = tree.is_rim(g) ? 0.0f : tree.brute_force(g);
      ASSERT_EQ(float_bits(tree.values[b * kBrickStride + static_cast<std::size_t>(i)]),
                float_bits(expected))
          << "brick " << b << " value " << i;
      ++checked;
    }
  }
  EXPECT_GE(checked, kBrickValues);
}

/// A brick that was dropped has all its points on one side of iso.
template <class F>
void expect_safe_rejection(const Grid& grid, int ball_count, unsigned seed) {
  OneLevel<F> tree(some_balls<F>(ball_count, seed), grid, 1.0f);
  const Node root;
  int dropped = 0;
  for (int child = 0; child < kChildren; ++child) {
    const Int3 p = child_position({1, 1, 1}, root, child);
    if (tree.active[child] || p.x >= tree.level.nodes.x || p.y >= tree.level.nodes.y ||
        p.z >= tree.level.nodes.z) {
      continue;
    }
    ++dropped;
    int inside = 0;
    for (int i = 0; i < kBrickValues; ++i) {
      const Int3 g = {p.x * kBrickCells + i % kBrickPoints - 1,
                      p.y * kBrickCells + i / kBrickPoints % kBrickPoints - 1,
                      p.z * kBrickCells + i / kBrickPoints / kBrickPoints - 1};
      inside += !tree.is_rim(g) && tree.brute_force(g) > 1.0f ? 1 : 0;
    }
    EXPECT_TRUE(inside == 0 || inside == kBrickValues) << "seed " << seed << " brick " << child;
  }
  EXPECT_GT(dropped, 0) << "nothing was culled: the test shows nothing";
}

TEST(Bricks, gaussian_values_are_those_of_all_balls_bit_for_bit) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    expect_exact_bricks<RoundGaussian>(cube_grid(15, 1.3f), 40, seed);
  }
}

TEST(Bricks, gaussian_values_are_exact_far_from_the_origin_too) {
  // Coarse floats: the box of a brick and its points round the same way.
  const Grid grid = {{999.3f, -500.7f, 250.1f}, 0.01f, {15, 14, 13}};
  std::vector<Ball> balls;
  for (Ball ball : random_balls(60, FieldKind::kGaussian, 3)) {
    ball.center = ball.center * 0.07f + Vec3{999.37f, -500.63f, 250.17f};
    ball.a *= 600;
    balls.push_back(ball);
  }
  OneLevel<RoundGaussian> tree(balls, grid, 1.0f);
  ASSERT_FALSE(tree.bricks.empty());
  for (std::size_t b = 0; b < tree.bricks.size(); ++b) {
    EXPECT_LT(tree.bricks[b].count, balls.size());
    const Int3 p = node_position(tree.level.nodes, tree.bricks[b].index);
    for (int i = 0; i < kBrickValues; ++i) {
      const Int3 g = {p.x * kBrickCells + i % kBrickPoints - 1,
                      p.y * kBrickCells + i / kBrickPoints % kBrickPoints - 1,
                      p.z * kBrickCells + i / kBrickPoints / kBrickPoints - 1};
      if (tree.is_rim(g)) continue;
      ASSERT_EQ(float_bits(tree.values[b * kBrickStride + static_cast<std::size_t>(i)]),
                float_bits(tree.brute_force(g)));
    }
  }
}

TEST(Bricks, ellipsoids_values_are_those_of_all_balls_bit_for_bit) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    expect_exact_bricks<Ellipsoids>(cube_grid(15, 1.3f), 40, seed);
    expect_exact_bricks<WyvillEllipsoids>(cube_grid(15, 1.3f), 40, seed);
  }
}

TEST(Bricks, wyvill_values_are_those_of_all_balls_bit_for_bit) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    expect_exact_bricks<RoundWyvill>(cube_grid(15, 1.3f), 40, seed);
  }
}

TEST(Bricks, inverse_square_values_are_those_of_all_balls_bit_for_bit) {
  expect_exact_bricks<InverseSquare>(cube_grid(14, 1.3f), 30, 7);
}

TEST(Bricks, dropped_bricks_do_not_cross_iso) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    expect_safe_rejection<RoundGaussian>(cube_grid(15, 1.5f), 12, seed);
    expect_safe_rejection<InverseSquare>(cube_grid(15, 2.5f), 12, seed);
    expect_safe_rejection<Ellipsoids>(cube_grid(15, 1.5f), 12, seed);
    expect_safe_rejection<RoundWyvill>(cube_grid(15, 1.5f), 12, seed);
  }
}

}  // namespace
}  // namespace polymorph
