// Bricks of which only some points are sampled have the surface of bricks that are sampled as a
// whole.
#include "kernels/sample_blocks.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "kernels/cpu_backend.h"
#include "kernels/level_set_passes.h"
#include "testing/backend.h"
#include "testing/between.h"
#include "testing/bricks.h"

namespace polymorph {
namespace {

/// All bricks of a grid, as one pass samples them.
template <class Sample, class V>
struct AllBricks : BrickBuffers {
  template <class FieldOrBounds>
  AllBricks(const FieldOrBounds& of, const Grid& grid) {
    const Int3 n = ceil_divide(lattice_cells(grid), kBrickCells);
    for (int z = 0; z < n.z; ++z)
      for (int y = 0; y < n.y; ++y)
        for (int x = 0; x < n.x; ++x) {
          bricks.emplace_back();
          bricks.back().at = {x, y, z};
        }
    const Sample sample{counting(grid, -grid.cell), of};
    const auto scratch = std::make_unique<typename Sample::Scratch>();
    for (std::size_t b = 0; b < bricks.size(); ++b)
      sample(CpuTeam<V>{}, *scratch, static_cast<std::int64_t>(b));
  }
};

/// Compares what later passes read, and returns the share of points that were sampled in bricks
/// with a surface.
template <class Bounds>
double expect_same_surface(const Bounds& bounds, const Grid& grid) {
  using Field = decltype(bounds.field);
  const AllBricks<SampleLevelSet<Field>, float> whole(bounds.field, grid);
  const AllBricks<SampleBlocks<Bounds>, Pack> blocks(bounds, grid);
  double sampled = 0, points = 0;
  for (std::size_t b = 0; b < whole.bricks.size(); ++b) {
    EXPECT_EQ(blocks.counts[b].vertices(), whole.counts[b].vertices()) << b;
    EXPECT_EQ(blocks.counts[b].triangles(), whole.counts[b].triangles()) << b;
    if (whole.counts[b].vertices() == 0) continue;
    const auto same = [b](const auto& x, const auto& y, std::size_t size) {
      return std::equal(x.data() + b * size, x.data() + (b + 1) * size, y.data() + b * size);
    };
    EXPECT_TRUE(same(blocks.inside, whole.inside, kLines)) << b;
    EXPECT_TRUE(same(blocks.rows, whole.rows, kRows)) << b;
    const float *value = blocks.values.data() + b * kBrickValues,
                *expected = whole.values.data() + b * kBrickValues;
    for (std::size_t r = 0; r < kRows; ++r)
      for (std::uint32_t edges = row_edges(whole.rows[b * kRows + r]); edges != 0;
           edges &= edges - 1) {
        const int edge = countr_zero(edges),
                  from = edge / 3 + kBrickPoints * line_of_row(static_cast<int>(r));
        for (const int i : {from, from + (edge % 3 == 0 ? 1 : edge % 3 == 1 ? 8 : 64)})
          EXPECT_EQ(float_bits(value[i]), float_bits(expected[i])) << b << ' ' << i;
      }
    // Points that are not sampled are given a value of one cell.
    for (int i = 0; i < kBrickValues; ++i) sampled += std::abs(value[i]) == grid.cell ? 0 : 1;
    points += kBrickValues;
  }
  EXPECT_GT(points, 0);
  return sampled / points;
}

void expect_same_surfaces_between() {
  Workspace<CpuBackend> work{CpuBackend{}};
  for (const unsigned seed : {1u, 2u}) {
    const bool sloped = seed == 2;
    MorphSurface surface = {random_map(60, 0.2f, seed, sloped),
                            torus_distances(0.8f, 0.5f),
                            sphere_distances(1),
                            1.1f,
                            0.9f,
                            0.03f,
                            sloped ? 0.1f : 0.0f};
    if (sloped) surface.smooth_from = torus_distances(0.8f, 0.4f);
    // Inside, where the border of the grid cuts the surface, and where a line of a brick has more
    // nodes than the brick's spline has columns.
    for (const Grid& grid : {cube_grid(60, 1.6f), cube_grid(40, 0.7f), cube_grid(9, 1.6f)})
      expect_same_surface(bound_morph(work, surface, grid), grid);
  }
  // Where the map is smooth, less than half of the points are sampled.
  const MorphSurface smooth = {
      identity_map(0.5f), torus_distances(0.8f, 0.5f), sphere_distances(1), 1, 1, 0};
  const Grid grid = cube_grid(60, 1.6f);
  EXPECT_LT(expect_same_surface(bound_morph(work, smooth, grid), grid), 0.5);
}

TEST(SampleBlocks, surfaces_between_objects_are_those_of_whole_bricks) {
  // On one thread: ThreadSanitizer knows oneTBB's own code by its file (tests/tsan.supp), which it
  // does not find for passes that the test itself instantiates.
  tbb::task_arena(1).execute(expect_same_surfaces_between);
}

TEST(SampleBlocks, surfaces_of_distances_are_those_of_whole_bricks) {
  const auto torus = torus_distances(1, 0.3f);
  const Grid grid = cube_grid(60, 1.6f);
  const DistanceBounds bounds = {DistanceField(torus->grid, torus->values.data()), torus->lipschitz,
                                 distance_rounding(grid)};
  EXPECT_LT(expect_same_surface(bounds, grid), 0.4);
}

}  // namespace
}  // namespace polymorph
