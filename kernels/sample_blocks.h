// Sampling of a level set's bricks in packs (level_set.h has what fields and bounds are). Marching
// cubes need values only at the ends of crossed edges, and elsewhere only the side of the surface.
// A brick's 8^3 points are 4^3 blocks of 2^3 points. Where the bounds leave one side to a block,
// its points get a value of that side, and the points of other blocks are sampled. Then those ends
// of crossed edges that have no value yet are sampled, too. So the mesh has the bits that it has if
// all points are sampled (SampleLevelSet), as on a GPU.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "bricks.h"
#include "field.h"
#include "level_set.h"
#include "tree.h"
#include "types.h"

namespace polymorph {

/// Samples the field where that is needed, and counts each brick's vertices and triangles
/// (CountBricks). One team per brick, a thread with packs of points.
template <class Bounds>
struct SampleBlocks;

#if defined(PM_PACKS)
template <class Bounds>
struct SampleBlocks : CountBricks {
  using Field = decltype(Bounds::field);
  using Box = typename Field::PackBox;
  static constexpr int kBlocks = 4;  ///< along an axis
  struct Scratch : CountBricks::Scratch {
    typename Box::Scratch box;
    alignas(64) std::uint32_t listed[kBrickValues];  ///< indices of points to be sampled
    /// Per layer of points along z: bit x + 8 y is set if that point is sampled or beyond the grid.
    std::uint64_t sampled[kBrickPoints];
  };
  Bounds bounds;

  template <class Team>
  void operator()(const Team& team, Scratch& scratch, std::int64_t item) const {
    using V = typename Team::V;
    const Int3 first = first_point(bricks[begin + item]);
    if (begin + item + 1 < bricks.size)
      bounds.field.prefetch(grid, first_point(bricks[begin + item + 1]));
    const BlockSides sides = find_sides(team, scratch, first);
    // Points beyond the grid are outside, too.
    if (sides.inside == 0 || (sides.outside == 0 && is_on_grid(first))) {
      counts[begin + item] = {};
      return;
    }
    Box box(scratch.box, bounds.field, brick_box(grid, first));
    fill_blocks(sides.inside, scratch.values);
    sample_blocks<V>(sides.inside & sides.outside, box, scratch);
    flag_inside(team, scratch, first);
    if (!is_on_grid(first)) {
      for (int line = 0; line < kLines; ++line) {
        scratch.sampled[line / kBrickPoints] |= std::uint64_t{beyond_grid(first, line)}
                                                << (kBrickPoints * (line % kBrickPoints));
      }
    }
    sample_crossed_edges<V>(box, scratch);
    count_flagged(team, scratch, item);
  }

 private:
  /// The sides on which each block can have points. Block (x, y, z) has bit x + 4 (y + 4 z).
  struct BlockSides {
    std::uint64_t inside = 0, outside = 0;
  };
  template <class Team>
  BlockSides find_sides(const Team& team, Scratch& scratch, Int3 first) const {
    using V = typename Team::V;
    constexpr int kLanes = Lanes<V>::kCount;
    const Vec3 low = grid_point(grid, first),
               high = grid_point(
                   grid, {first.x + kBrickCells, first.y + kBrickCells, first.z + kBrickCells});
    // The middles of blocks are the first 4^3 points of a box; its other points repeat the last
    // one.
    const float half_cell = 0.5f * grid.cell;
    const Vec3 half = {half_cell, half_cell, half_cell};
    const Pack at = {0, 1, 2, 3, 3, 3, 3, 3};
    const Vec3 middle = low + half;
    const auto axis = [&](float lowest) { return lowest + 2 * grid.cell * at; };
    Box box(scratch.box, bounds.field, {{axis(middle.x), axis(middle.y), axis(middle.z)}});
    box.add_lines(0x0f0f0f0fu);
    const typename Bounds::Local local = bounds.local(team, NodeBox{low, high, /*has_rim=*/false});
    BlockSides out;
    for (int begin_block = 0; begin_block < kBlocks * kBlocks * kBlocks; begin_block += kLanes) {
      alignas(64) std::uint32_t middles[kLanes];
      for (int l = 0; l < kLanes; ++l) {
        const auto block = static_cast<std::uint32_t>(begin_block + l);
        middles[l] = block % kBlocks +
                     kBrickPoints * (block / kBlocks % kBlocks + kBrickPoints * (block / 16));
      }
      const Sides sides = bounds.template sides<V>(box, middles, half, local);
      out.inside |= std::uint64_t{sides.inside} << begin_block;
      out.outside |= std::uint64_t{sides.outside} << begin_block;
    }
    return out;
  }

  /// Sets the points of each block to 1 cell inside or outside.
  void fill_blocks(std::uint64_t inside_blocks, float* points) const {
    const PackBits bit = {1, 1, 2, 2, 4, 4, 8, 8};
    for (int row = 0; row < kBlocks * kBlocks; ++row) {
      const auto bits = static_cast<std::uint32_t>(inside_blocks >> (kBlocks * row)) & 0xfu;
      const Pack line =
          select((bit & bits) != 0u, broadcast<Pack>(grid.cell), broadcast<Pack>(-grid.cell));
      float* lowest = points + 2 * kBrickPoints * (row % kBlocks + kBrickPoints * (row / kBlocks));
      for (const int next : {0, kBrickPoints, kLines, kLines + kBrickPoints})
        Lanes<Pack>::store(lowest + next, line);
    }
  }

  /// Samples the points of the blocks that have a bit.
  template <class V>
  void sample_blocks(std::uint64_t blocks, Box& box, Scratch& scratch) const {
    std::fill_n(scratch.sampled, kBrickPoints, std::uint64_t{0});
    int count = 0;
    std::uint64_t lines = 0;
    const PackBits corners = {0, 1, 8, 9, 64, 65, 72, 73};
    for (; blocks != 0; blocks &= blocks - 1) {
      const int block = countr_zero(blocks), x = 2 * (block % kBlocks),
                y = 2 * (block / kBlocks % kBlocks), z = 2 * (block / kBlocks / kBlocks);
      const PackBits points = corners + static_cast<std::uint32_t>(x + 8 * (y + 8 * z));
      std::memcpy(scratch.listed + count, &points, sizeof points);
      count += kBrickPoints;
      lines |= std::uint64_t{0x303} << (y + 8 * z);
      const std::uint64_t of_layer = std::uint64_t{0x303} << (x + 8 * y);
      scratch.sampled[z] |= of_layer, scratch.sampled[z + 1] |= of_layer;
    }
    box.add_lines(lines);
    sample_listed<V>(count, box, scratch);
  }

  /// Samples those ends of crossed edges that are not sampled yet.
  template <class V>
  void sample_crossed_edges(Box& box, Scratch& scratch) const {
    std::uint64_t inside_layers[kBrickPoints];
    std::memcpy(inside_layers, scratch.inside, sizeof inside_layers);
    constexpr std::uint64_t kCells = CellFlags</*kPlane=*/true>::kCells;
    int count = 0;
    std::uint64_t lines = 0, ends_above = 0;
    for (int z = 0; z < kBrickPoints; ++z) {
      const std::uint64_t layer = inside_layers[z];
      std::uint64_t ends = ends_above;
      if (z < kBrickCells) {
        const std::uint64_t along_x = (layer ^ layer >> 1) & kCells,
                            along_y = (layer ^ layer >> kBrickPoints) & kCells;
        ends_above = (layer ^ inside_layers[z + 1]) & kCells;
        ends |= along_x | along_x << 1 | along_y | along_y << kBrickPoints | ends_above;
      }
      for (ends &= ~scratch.sampled[z]; ends != 0; ends &= ends - 1) {
        const int point = countr_zero(ends) + kLines * z;
        scratch.listed[count++] = static_cast<std::uint32_t>(point);
        lines |= std::uint64_t{1} << (point / kBrickPoints);
      }
    }
    box.add_lines(lines);
    sample_listed<V>(count, box, scratch);
  }

  /// Samples the first `count` listed points.
  template <class V>
  void sample_listed(int count, const Box& box, Scratch& scratch) const {
    constexpr int kLanes = Lanes<V>::kCount;
    // Lanes beyond the last point repeat it.
    for (int i = count; i % kLanes != 0; ++i) scratch.listed[i] = scratch.listed[count - 1];
    for (int begin_point = 0; begin_point < count; begin_point += kLanes) {
      const std::uint32_t* points = scratch.listed + begin_point;
      alignas(64) float sampled[kLanes];
      Lanes<V>::store(sampled, box.template value<V>(points));
      for (int l = 0; l < kLanes; ++l) scratch.values[points[l]] = sampled[l];
    }
  }
};
#endif

}  // namespace polymorph
