// Bricks and what the passes that count them write, for tests of single passes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernels/bricks.h"

namespace polymorph {

/// Views a whole vector.
template <class T>
View<T> view_of(std::vector<T>& v) {
  return {v.data(), static_cast<std::int64_t>(v.size())};
}

/// Memory of CountBricks and of the passes after it.
struct BrickBuffers {
  std::vector<BrickTable> table = {brick_table()};
  std::vector<Node> bricks;
  std::vector<float> values;
  std::vector<std::uint8_t> inside;
  std::vector<std::uint32_t> rows;
  std::vector<Counts> counts;

  /// Returns the counting part of a pass over `bricks`, for the level 0.
  CountBricks counting(const Grid& grid, float outside) {
    values.resize(bricks.size() * kBrickValues);
    inside.resize(bricks.size() * kLines);
    rows.resize(bricks.size() * kRows);
    counts.assign(bricks.size(), Counts{7, 7});  // a brick without a surface must say so
    CountBricks count;
    count.grid = grid;
    count.iso = 0;
    count.outside = outside;
    count.table = view_of(table);
    count.bricks = view_of(bricks);
    count.values = view_of(values);
    count.inside = view_of(inside);
    count.rows = view_of(rows);
    count.counts = view_of(counts);
    return count;
  }
};

}  // namespace polymorph
