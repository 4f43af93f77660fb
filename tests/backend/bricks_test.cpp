// Culling is exact: a brick's short list of balls gives the bits of the sum over all balls.
#include "kernels/bricks.h"

#include <gtest/gtest.h>

#include <memory>
#include <type_traits>
#include <vector>

#include "backend_fixture.h"
#include "kernels/cpu_backend.h"

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
template <class F, class V>
struct OneLevel {
  Grid grid;
  float iso;
  Level level;
  std::vector<typename F::Ball> balls;
  std::vector<std::uint32_t> everyone, child_entries, entries;
  std::vector<Node> root, bricks;

  OneLevel(const std::vector<Ball>& raw, const Grid& g, float level_of_field)
      : grid(g), iso(level_of_field) {
    const Int3 n = g.points;
    level.nodes = {(n.x + kBrickCells) / kBrickCells, (n.y + kBrickCells) / kBrickCells,
                   (n.z + kBrickCells) / kBrickCells};
    std::vector<Ball> copy = raw;
    balls.resize(raw.size());
    everyone.resize(raw.size());
    const PrepareBalls<F> prepare = {view_of(copy),
                                     view_of(balls),
                                     view_of(everyone),
                                     FieldScale{log_of_two(1e-4f * iso), 2},
                                     {},
                                     {}};
    for (std::size_t i = 0; i < raw.size(); ++i) prepare(static_cast<std::int64_t>(i));
    root.resize(1);
    root[0].count = static_cast<std::uint32_t>(raw.size());
    child_entries.resize(kChildren);
    std::vector<Counts> counts(1);
    std::vector<Offsets> first(1);
    const ClassifyChildren<F> classify = {g,
                                          iso,
                                          level,
                                          view_of(root),
                                          view_of(everyone),
                                          view_of(balls),
                                          view_of(child_entries),
                                          view_of(counts)};
    typename ClassifyChildren<F>::Scratch classified;
    classify(CpuTeam<V>{}, classified, 0);
    bricks.resize(counts[0].first);
    entries.resize(counts[0].second);
    const FillChildren<F> fill = {g,
                                  level,
                                  view_of(root),
                                  view_of(everyone),
                                  view_of(balls),
                                  view_of(child_entries),
                                  view_of(first),
                                  view_of(bricks),
                                  view_of(entries)};
    typename FillChildren<F>::Scratch filled;
    fill(CpuTeam<V>{}, filled, 0);
    if (!F::kEnds) entries = everyone;
  }

  /// The values that a brick's pass sees.
  std::vector<float> values_of(std::size_t brick) {
    std::vector<BrickTable> table = {brick_table()};
    std::vector<float> values(bricks.size() * kBrickValues);
    std::vector<std::uint8_t> inside(bricks.size() * kLines);
    std::vector<std::uint32_t> rows(bricks.size() * kRows);
    std::vector<Counts> counts(bricks.size());
    const SampleBricks<F> sample = {grid,
                                    iso,
                                    1,
                                    false,
                                    view_of(table),
                                    view_of(bricks),
                                    view_of(entries),
                                    view_of(balls),
                                    view_of(values),
                                    view_of(inside),
                                    view_of(rows),
                                    view_of(counts)};
    auto scratch = std::make_unique<typename SampleBricks<F>::Scratch>();
    sample(CpuTeam<V>{}, *scratch, static_cast<std::int64_t>(brick));
    return {scratch->values, scratch->values + kBrickValues};
  }

  /// Sum over all balls at one grid point.
  float brute_force(Int3 point) {
    std::vector<Vec3> at = {grid_point(grid, point)};
    std::vector<float> value(1);
    const BallList all = {everyone.data(), static_cast<std::uint32_t>(everyone.size())};
    SamplePoints<F, float>{view_of(at), view_of(balls), all, view_of(value)}(0);
    return value[0];
  }

  Int3 point_of(Int3 brick, int i) const {
    return {brick.x * kBrickCells + i % kBrickPoints - 1,
            brick.y * kBrickCells + i / kBrickPoints % kBrickPoints - 1,
            brick.z * kBrickCells + i / kLines - 1};
  }
  bool is_rim(Int3 g) const {
    return g.x < 0 || g.y < 0 || g.z < 0 || g.x >= grid.points.x || g.y >= grid.points.y ||
           g.z >= grid.points.z;
  }
};

template <class F, class V>
void expect_exact(OneLevel<F, V>& tree) {
  ASSERT_FALSE(tree.bricks.empty());
  for (std::size_t b = 0; b < tree.bricks.size(); ++b) {
    const std::vector<float> values = tree.values_of(b);
    for (int i = 0; i < kBrickValues; ++i) {
      const Int3 g = tree.point_of(tree.bricks[b].at, i);
      const float expected = tree.is_rim(g) ? 0.0f : tree.brute_force(g);
      ASSERT_EQ(float_bits(values[static_cast<std::size_t>(i)]), float_bits(expected))
          << "brick " << b << " value " << i;
    }
  }
}

template <class F>
void expect_exact_bricks(const Grid& grid, int ball_count, unsigned seed) {
  OneLevel<F, Pack> packs(some_balls<F>(ball_count, seed), grid, 1.0f);
  expect_exact(packs);
  OneLevel<F, float> ones(some_balls<F>(ball_count, seed), grid, 1.0f);
  expect_exact(ones);
  EXPECT_EQ(packs.entries, ones.entries);
}

/// A brick that was dropped has all its points on one side of iso.
template <class F>
void expect_safe_rejection(const Grid& grid, int ball_count, unsigned seed) {
  OneLevel<F, Pack> tree(some_balls<F>(ball_count, seed), grid, 1.0f);
  int dropped = 0;
  for (int child = 0; child < kChildren; ++child) {
    const Int3 p = child_position({}, child);
    if (tree.root[0].children >> child & 1u || p.x >= tree.level.nodes.x ||
        p.y >= tree.level.nodes.y || p.z >= tree.level.nodes.z) {
      continue;
    }
    ++dropped;
    int inside = 0;
    for (int i = 0; i < kBrickValues; ++i) {
      const Int3 g = tree.point_of(p, i);
      inside += !tree.is_rim(g) && tree.brute_force(g) > 1.0f ? 1 : 0;
    }
    EXPECT_TRUE(inside == 0 || inside == kBrickValues) << "seed " << seed << " brick " << child;
  }
  EXPECT_GT(dropped, 0) << "nothing was culled: the test shows nothing";
}

TEST(Bricks, gaussian_values_are_those_of_all_balls_bit_for_bit) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    expect_exact_bricks<RoundGaussian>(cube_grid(26, 1.3f), 40, seed);
  }
}

TEST(Bricks, gaussian_values_are_exact_far_from_the_origin_too) {
  // Coarse floats: the box of a brick and its points round the same way.
  const Grid grid = {{999.3f, -500.7f, 250.1f}, 0.005f, {27, 26, 22}};
  std::vector<Ball> balls;
  for (Ball ball : random_balls(60, FieldKind::kGaussian, 3)) {
    ball.center = ball.center * 0.07f + Vec3{999.37f, -500.63f, 250.17f};
    ball.a *= 600;
    balls.push_back(ball);
  }
  OneLevel<RoundGaussian, Pack> tree(balls, grid, 1.0f);
  expect_exact(tree);
  for (const Node& brick : tree.bricks) EXPECT_LT(brick.count, balls.size());
}

TEST(Bricks, ellipsoids_values_are_those_of_all_balls_bit_for_bit) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    expect_exact_bricks<Ellipsoids>(cube_grid(26, 1.3f), 40, seed);
    expect_exact_bricks<WyvillEllipsoids>(cube_grid(26, 1.3f), 40, seed);
  }
}

TEST(Bricks, wyvill_values_are_those_of_all_balls_bit_for_bit) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    expect_exact_bricks<RoundWyvill>(cube_grid(26, 1.3f), 40, seed);
  }
}

TEST(Bricks, inverse_square_values_are_those_of_all_balls_bit_for_bit) {
  expect_exact_bricks<InverseSquare>(cube_grid(27, 1.3f), 30, 7);
}

TEST(Bricks, dropped_bricks_do_not_cross_iso) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    expect_safe_rejection<RoundGaussian>(cube_grid(26, 1.5f), 12, seed);
    expect_safe_rejection<InverseSquare>(cube_grid(26, 2.5f), 12, seed);
    expect_safe_rejection<Ellipsoids>(cube_grid(26, 1.5f), 12, seed);
    expect_safe_rejection<RoundWyvill>(cube_grid(26, 1.5f), 12, seed);
  }
}

}  // namespace
}  // namespace polymorph
