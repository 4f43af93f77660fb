// Culling is exact: a brick's short list of balls gives the bits of the sum over all balls. Where
// support is infinite, list and polynomial give it within a bound, and which points are inside
// exactly.
#include "kernels/bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <type_traits>
#include <vector>

#include "kernels/cpu_backend.h"
#include "kernels/expand_far_field.h"
#include "testing/backend.h"
#include "testing/bricks.h"

namespace polymorph {
namespace {

using RoundGaussian = Field<GaussianField, RoundBall>;
using Ellipsoids = Field<GaussianField, EllipsoidBall>;
using RoundWyvill = Field<WyvillField, RoundBall>;
using WyvillEllipsoids = Field<WyvillField, EllipsoidBall>;
using InverseSquare = Field<InverseSquareField, RoundBall>;

template <class F>
std::vector<Ball> some_balls(int count, unsigned seed) {
  const std::vector<Ball> balls = random_balls(count, F::Kind::kKind, seed);
  return std::is_same_v<typename F::Ball, EllipsoidBall> ? squeezed(balls, seed) : balls;
}

/// One step of the tree by hand: the root's children are bricks.
template <class F, class V>
struct OneLevel {
  Grid grid;
  float iso;
  Level level;
  std::vector<typename F::Ball> balls;
  std::vector<std::uint32_t> all_balls, child_entries, entries;
  std::vector<Node> root, bricks;
  std::vector<FarField> root_far, far;

  OneLevel(const std::vector<Ball>& raw, const Grid& g, float level_of_field)
      : grid(g), iso(level_of_field) {
    const Int3 n = g.points;
    level.nodes = {(n.x + kBrickCells) / kBrickCells, (n.y + kBrickCells) / kBrickCells,
                   (n.z + kBrickCells) / kBrickCells};
    std::vector<Ball> copy = raw;
    balls.resize(raw.size());
    all_balls.resize(raw.size());
    root.resize(1);
    if (!F::kCompactSupport) root_far.resize(1);
    std::vector<Counts> node_counts(1), no_counts;
    std::vector<Offsets> root_count(1), first(1);
    constexpr float kLength = 2;
    const PrepareBalls<F> prepare = {view_of(copy),        view_of(balls),
                                     view_of(all_balls),   FieldScale{log2(1e-4f * iso), kLength},
                                     Int3{1, 1, 1},        view_of(root),
                                     view_of(node_counts), view_of(root_count),
                                     view_of(root_far)};
    for (std::size_t i = 0; i < raw.size(); ++i) prepare(static_cast<std::int64_t>(i));
    set_reach(level, grid.cell / kLength, iso);
    child_entries.resize(kChildren);
    const ClassifyChildren<F> classify = {g,
                                          iso,
                                          level,
                                          view_of(root),
                                          view_of(all_balls),
                                          view_of(balls),
                                          view_of(child_entries),
                                          view_of(node_counts),
                                          view_of(root_far)};
    typename ClassifyChildren<F>::Scratch classified;
    classify(CpuTeam<V>{}, classified, 0);
    bricks.resize(node_counts[0].nodes());
    entries.resize(node_counts[0].entries());
    const FillChildren<F> fill = {g,
                                  level,
                                  view_of(root),
                                  view_of(all_balls),
                                  view_of(balls),
                                  view_of(child_entries),
                                  view_of(first),
                                  view_of(bricks),
                                  view_of(no_counts),
                                  view_of(entries)};
    typename FillChildren<F>::Scratch filled;
    fill(CpuTeam<V>{}, filled, 0);
    if constexpr (!F::kCompactSupport) {
      far.resize(bricks.size());
      const ExpandFarField<F> expand = {g,
                                        level,
                                        view_of(root),
                                        view_of(bricks),
                                        view_of(all_balls),
                                        view_of(balls),
                                        view_of(root_far),
                                        view_of(far)};
      typename ExpandFarField<F>::Scratch expanded;
      for (std::size_t b = 0; b < bricks.size(); ++b)
        expand(CpuTeam<V>{}, expanded, static_cast<std::int64_t>(b));
    }
  }

  BallList all() const { return {all_balls.data(), static_cast<std::uint32_t>(all_balls.size())}; }

  SampleBricks<F> sampler() {
    SampleBricks<F> sample;
    sample.grid = grid;
    sample.iso = iso;
    sample.bricks = view_of(bricks);
    sample.entries = view_of(entries);
    sample.balls = view_of(balls);
    sample.far = view_of(far);
    sample.all_balls = all();
    return sample;
  }

  /// The values that a brick's pass sees.
  std::vector<float> values_of(std::size_t brick) {
    std::vector<BrickTable> table = {brick_table()};
    std::vector<float> values(bricks.size() * kBrickValues);
    std::vector<std::uint8_t> inside(bricks.size() * kLines);
    std::vector<std::uint32_t> rows(bricks.size() * kRows);
    std::vector<Counts> counts(bricks.size());
    SampleBricks<F> sample = sampler();
    sample.table = view_of(table);
    sample.values = view_of(values);
    sample.inside = view_of(inside);
    sample.rows = view_of(rows);
    sample.counts = view_of(counts);
    auto scratch = std::make_unique<typename SampleBricks<F>::Scratch>();
    sample(CpuTeam<V>{}, *scratch, static_cast<std::int64_t>(brick));
    return {scratch->values, scratch->values + kBrickValues};
  }

  /// Sum over all balls at one grid point.
  float brute_force(Int3 point) {
    std::vector<Vec3> at = {grid_point(grid, point)};
    std::vector<float> value(1);
    SamplePoints<F, float>{view_of(at), view_of(balls), all(), view_of(value)}(0);
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

/// Of the field's balls, in double.
struct TrueSums {
  double value = 0, size = 0;  ///< size: of the absolute values
  double slope[3] = {0, 0, 0};
};
template <class V>
TrueSums true_sums(const OneLevel<InverseSquare, V>& tree, Vec3 p) {
  TrueSums sums;
  for (const RoundBall& b : tree.balls) {
    const auto along = [&](float to, float from) {
      return static_cast<double>(b.scale) * (static_cast<double>(to) - static_cast<double>(from));
    };
    const double d[3] = {along(p.x, b.x), along(p.y, b.y), along(p.z, b.z)};
    const double q = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + static_cast<double>(b.base);
    const double term = static_cast<double>(b.w) / q;
    sums.value += term, sums.size += std::abs(term);
    for (int a = 0; a < 3; ++a) sums.slope[a] -= 2 * static_cast<double>(b.scale) * d[a] * term / q;
  }
  return sums;
}

/// What a set of bricks was like.
struct FarReport {
  std::size_t distant = 0;  ///< balls that are in no list, over all bricks
  int exact = 0;            ///< points whose value is the exact one for being near iso
  double worst = 0;         ///< error of a value as a share of its bound
  double moved = 0;         ///< how far errors of values near iso move the surface, in cells
  double turned = 0;        ///< error of a slope as a share of it
};

/// Each value is within its brick's bound of the exact one, and on the same side of iso, to the bit
/// of the exact sum.
template <class V>
void expect_bounded(OneLevel<InverseSquare, V>& tree, FarReport& report) {
  ASSERT_FALSE(tree.bricks.empty());
  const SampleBricks<InverseSquare> sample = tree.sampler();
  for (std::size_t b = 0; b < tree.bricks.size(); ++b) {
    const std::vector<float> values = tree.values_of(b);
    const FarField& far = tree.far[b];
    report.distant += tree.balls.size() - tree.bricks[b].count;
    const float error_bound = sample.error_bound(far);
    const BrickField<InverseSquare> field(tree.grid, 0, tree.bricks[b], tree.balls.data(),
                                          tree.entries.data(), &far);
    for (int i = 0; i < kBrickValues; ++i) {
      const Int3 g = tree.point_of(tree.bricks[b].at, i);
      if (tree.is_rim(g)) continue;
      const float value = values[static_cast<std::size_t>(i)], exact = tree.brute_force(g);
      ASSERT_EQ(value > tree.iso, exact > tree.iso) << "brick " << b << " value " << i;
      if (float_bits(value) == float_bits(exact)) {
        report.exact += std::abs(exact - tree.iso) <= error_bound ? 1 : 0;
        continue;
      }
      ASSERT_GT(std::abs(value - tree.iso), 0.99f * error_bound) << "brick " << b << " value " << i;
      // The polynomial's own bound, and the rounding of a sum as doubt() has it.
      const Vec3 p = grid_point(tree.grid, g);
      const TrueSums sums = true_sums(tree, p);
      const double rounding =
          0x1p-24 * (40 + 0.5 * static_cast<double>(tree.balls.size())) * sums.size;
      const double off = std::abs(static_cast<double>(value) - sums.value);
      const double share = off / (static_cast<double>(far.error + far.rounding) + rounding);
      ASSERT_LE(share, 1.0) << "brick " << b << " value " << i << ": " << value << " for "
                            << sums.value;
      report.worst = std::max(report.worst, share);
      const double* g3 = sums.slope;
      const double slope = std::hypot(g3[0], g3[1], g3[2]);
      const double negated_derivative = slope * static_cast<double>(tree.grid.cell);
      if (std::abs(exact - tree.iso) > 0.3f * tree.iso || negated_derivative < 0.01) continue;
      report.moved = std::max(report.moved, off / negated_derivative);
      const Points<float> down = field.negated_gradient(Points<float>{p.x, p.y, p.z});
      report.turned = std::max(report.turned, std::hypot(2 * static_cast<double>(down.x) + g3[0],
                                                         2 * static_cast<double>(down.y) + g3[1],
                                                         2 * static_cast<double>(down.z) + g3[2]) /
                                                  slope);
    }
  }
}

TEST(Bricks, inverse_square_values_are_within_their_bound_and_on_the_exact_side) {
  FarReport report;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    for (const bool holes : {false, true}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " holes " << holes);
      std::vector<Ball> balls = some_balls<InverseSquare>(300, seed);
      for (Ball& ball : balls) ball.w *= holes ? 0.4f : 0.15f;
      if (holes) balls = with_holes(balls);
      for (const float half : {1.3f, 0.4f}) {
        OneLevel<InverseSquare, Pack> tree(balls, cube_grid(27, half), 1.0f);
        ASSERT_NO_FATAL_FAILURE(expect_bounded(tree, report));
      }
    }
  }
  EXPECT_GT(report.distant, 10000u) << "nothing was distant: the test shows nothing";
  EXPECT_GT(report.exact, 0) << "no point was near iso: the test shows nothing";
  EXPECT_GT(report.worst, 1e-3) << "the bound says nothing";
  EXPECT_LT(report.moved, 1e-3);
  EXPECT_LT(report.turned, 3e-3);
}

TEST(Bricks, inverse_square_bricks_do_not_depend_on_the_lanes) {
  const std::vector<Ball> balls = with_holes(some_balls<InverseSquare>(200, 9));
  OneLevel<InverseSquare, Pack> packs(balls, cube_grid(27, 1.3f), 1.0f);
  OneLevel<InverseSquare, float> ones(balls, cube_grid(27, 1.3f), 1.0f);
  EXPECT_EQ(packs.entries, ones.entries);
  ASSERT_EQ(packs.far.size(), ones.far.size());
  for (std::size_t b = 0; b < packs.far.size(); ++b) {
    ASSERT_EQ(std::memcmp(&packs.far[b], &ones.far[b], sizeof(FarField)), 0) << b;
    ASSERT_EQ(packs.values_of(b), ones.values_of(b)) << b;
  }
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
