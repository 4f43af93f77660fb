// From brick values to counted rows, and from there to triangles.
//
// A row is four lattice points along x in one brick, with the cells and the edges whose lower
// corner they are; so every cell and every edge belongs to exactly one row. Rows are numbered in
// the order of the whole lattice (z, then y, then x): vertices come out sorted by (lower point,
// axis) and triangles by cell, as a plain loop over the grid would give them, whatever the bricks
// are.
#pragma once

#include <cstdint>

#include "bricks.h"
#include "host_device.h"
#include "math.h"
#include "mc_tables.h"
#include "types.h"
#include "view.h"

namespace polymorph {

constexpr int kRows = kBrickCells * kBrickCells;  ///< of a brick
constexpr int kRowEdges = 3 * kBrickCells;        ///< bit 3 x + axis of a row's mask

/// Where a row lies in the order of the lattice. `map` holds, for each brick of the lattice (and
/// one past the end), how many active bricks come before it.
struct RowOrder {
  Int3 nodes;  ///< bricks along each axis
  View<const std::uint32_t> map;

  /// Row (y, z) of active brick number `brick`, which has index `index` in the lattice.
  PM_HD std::int64_t operator()(std::uint32_t index, std::uint32_t brick, int y, int z) const {
    const std::uint32_t line_size = static_cast<std::uint32_t>(nodes.x);
    const std::uint32_t slab_size = line_size * static_cast<std::uint32_t>(nodes.y);
    const std::uint32_t line = index / line_size * line_size, slab = index / slab_size * slab_size;
    const std::int64_t line_begin = map[line], line_end = map[line + line_size];
    const std::int64_t slab_begin = map[slab], slab_end = map[slab + slab_size];
    // All rows of lower slabs, then of lower z in this slab, then of lower lines, then of lower y.
    return kRows * slab_begin +
           kBrickCells * (z * (slab_end - slab_begin) + line_begin - slab_begin) +
           y * (line_end - line_begin) + brick - line_begin;
  }
};

PM_HD inline int local_point(int x, int y, int z) {
  return x + kBrickPoints * (y + kBrickPoints * z);
}

/// Inside flags (bit x) of the five points from (0, y, z).
PM_HD inline std::uint32_t inside_bits(const float* values, int y, int z, float iso) {
  std::uint32_t bits = 0;
  for (int x = 0; x < kBrickPoints; ++x) {
    bits |= (values[local_point(x, y, z)] > iso ? 1u : 0u) << x;
  }
  return bits;
}

/// The inside flags around one row: [y][z] of its four lines of points.
struct RowFlags {
  std::uint32_t bits[2][2];

  PM_HD RowFlags(const float* values, int y, int z, float iso) {
    for (int dy = 0; dy < 2; ++dy) {
      for (int dz = 0; dz < 2; ++dz) bits[dy][dz] = inside_bits(values, y + dy, z + dz, iso);
    }
  }

  PM_HD int key(int x) const {
    std::uint32_t key = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const std::uint32_t line = bits[corner >> 1 & 1][corner >> 2 & 1];
      key |= (line >> (x + (corner & 1)) & 1u) << (7 - corner);  // corner_weight
    }
    return static_cast<int>(key);
  }

  PM_HD std::uint32_t crossings() const {
    const std::uint32_t here = bits[0][0];
    const std::uint32_t axes[3] = {here ^ here >> 1, here ^ bits[1][0], here ^ bits[0][1]};
    std::uint32_t mask = 0;
    for (int x = 0; x < kBrickCells; ++x) {
      for (int axis = 0; axis < 3; ++axis) mask |= (axes[axis] >> x & 1u) << (3 * x + axis);
    }
    return mask;
  }

  PM_HD bool uniform() const {
    const std::uint32_t any = bits[0][0] | bits[0][1] | bits[1][0] | bits[1][1];
    const std::uint32_t all = bits[0][0] & bits[0][1] & bits[1][0] & bits[1][1];
    return any == 0 || all == (1u << kBrickPoints) - 1;
  }
};

/// Counts vertices and triangles of each row. One item a row of a brick.
struct CountRows {
  float iso = 1;
  View<const McTable> table;
  View<const Node> bricks;
  View<const float> values;
  RowOrder order;
  View<std::uint16_t> masks;  ///< crossed edges
  View<std::uint8_t> vertices;
  View<std::uint8_t> triangles;

  PM_HD void operator()(std::int64_t item) const {
    if (item >= bricks.size * kRows) return;
    const std::int64_t brick = item / kRows;
    const int y = static_cast<int>(item % kBrickCells);
    const int z = static_cast<int>(item / kBrickCells % kBrickCells);
    const RowFlags flags(values.data + brick * kBrickStride, y, z, iso);
    const std::int64_t row = order(bricks[brick].index, static_cast<std::uint32_t>(brick), y, z);
    std::uint32_t mask = 0, count = 0;
    if (!flags.uniform()) {
      mask = flags.crossings();
      for (int x = 0; x < kBrickCells; ++x) count += table.data->count[flags.key(x)];
    }
    masks[row] = static_cast<std::uint16_t>(mask);
    vertices[row] = static_cast<std::uint8_t>(count_bits(mask));
    triangles[row] = static_cast<std::uint8_t>(count);
  }
};

/// Numbers of the vertices on edges, from the rows' masks and the scan of their counts.
struct VertexNumbers {
  RowOrder order;
  View<const std::uint16_t> masks;
  View<const std::int64_t> first;  ///< vertex of each row
};

/// Numbers of the vertices on edges whose lower point lies in or next to one row of a brick.
class RowNumbers {
 public:
  PM_HD RowNumbers(const VertexNumbers& numbers, Int3 brick, int y, int z)
      : numbers_(numbers), brick_(brick), y_(y), z_(z) {}

  /// The vertex on the edge along `axis` from point (x, y + dy, z + dz). What lies in the next
  /// brick is found there: it is active, because this edge crosses the surface in it too.
  PM_HD std::uint32_t operator()(int x, int dy, int dz, int axis) {
    const int next = x / kBrickCells;
    Row& row = rows_[next][dy][dz];
    if (!row.known) row = find(next, y_ + dy, z_ + dz);
    const std::uint32_t before = (1u << (3 * (x % kBrickCells) + axis)) - 1;
    return row.first + static_cast<std::uint32_t>(count_bits(row.mask & before));
  }

 private:
  struct Row {
    std::uint32_t first = 0, mask = 0;
    bool known = false;
  };

  PM_HD Row find(int next, int y, int z) const {
    const Int3 at = {brick_.x + next, brick_.y + y / kBrickCells, brick_.z + z / kBrickCells};
    const RowOrder& order = numbers_.order;
    const auto index = static_cast<std::uint32_t>(node_index(order.nodes, at));
    const std::int64_t row = order(index, order.map[index], y % kBrickCells, z % kBrickCells);
    return {static_cast<std::uint32_t>(numbers_.first[row]), numbers_.masks[row], true};
  }

  const VertexNumbers& numbers_;
  Int3 brick_;
  int y_, z_;
  Row rows_[2][2][2];
};

/// Writes the triangles of each row. One item a row of a brick.
struct EmitTriangles {
  float iso = 1;
  View<const McTable> table;
  View<const Node> bricks;
  View<const float> values;
  VertexNumbers numbers;
  View<const std::int64_t> first;  ///< triangle of each row
  View<Triangle> triangles;

  PM_HD void operator()(std::int64_t item) const {
    if (item >= bricks.size * kRows) return;
    const std::int64_t brick = item / kRows;
    const int y = static_cast<int>(item % kBrickCells);
    const int z = static_cast<int>(item / kBrickCells % kBrickCells);
    const RowFlags flags(values.data + brick * kBrickStride, y, z, iso);
    if (flags.uniform()) return;
    const std::uint32_t index = bricks[brick].index;
    std::int64_t out = first[numbers.order(index, static_cast<std::uint32_t>(brick), y, z)];
    RowNumbers vertices(numbers, node_position(numbers.order.nodes, index), y, z);
    for (int x = 0; x < kBrickCells; ++x) {
      const int key = flags.key(x);
      const std::uint8_t* edges = table.data->edges[key];
      for (int t = 0; t < table.data->count[key]; ++t, edges += 3) {
        Triangle triangle;
        for (int v = 0; v < 3; ++v) {
          const int low = edge_low_corner(edges[v]);
          triangle.v[v] = vertices(x + (low & 1), low >> 1 & 1, low >> 2, edge_axis(edges[v]));
        }
        triangles[out++] = triangle;
      }
    }
  }
};

}  // namespace polymorph
