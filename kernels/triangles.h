// Triangle emission of marching cubes: the triangles of a brick's cells, with the indices of the
// vertices on their edges. Each edge of a cell has a slot: a line of points along x has kLineSlots
// slots, three for each point, one per axis (mc_tables.h).
#pragma once

#include <cstdint>

#include "bricks.h"
#include "host_device.h"
#include "mc_tables.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// Writes the vertex indices of a cell's triangles. `vertex`: the index of the vertex in each
/// slot (BrickTable), beginning with the first slot of the cell's lowest corner. `corners`: bit i
/// is set if corner i is inside; `count`: 3 times the number of triangles.
template <class V>
PM_HD inline void write_cell_triangles(const std::uint32_t* vertex, const BrickTable& table,
                                       int corners, int count, std::uint32_t* to) {
  const std::uint8_t* slots = table.slots[corners];
  for (int i = 0; i < count; ++i) to[i] = vertex[slots[i]];
}
#if defined(PM_WIDE_PACKS)
/// A cell's edges are in four lines of slots, which fit into two vectors. So one permutation
/// replaces up to 15 loads and a branch that is hard to predict.
template <>
inline void write_cell_triangles<WidePack>(const std::uint32_t* vertex, const BrickTable& table,
                                           int corners, int count, std::uint32_t* to) {
  const auto two_lines = [&](int line) {
    const auto* at = reinterpret_cast<const __m256i*>(vertex + kLineSlots * line);
    const auto* next = reinterpret_cast<const __m256i*>(vertex + kLineSlots * (line + 1));
    return _mm512_inserti64x4(_mm512_castsi256_si512(_mm256_loadu_si256(at)),
                              _mm256_loadu_si256(next), 1);
  };
  const __m512i lanes =
      _mm512_cvtepu8_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(table.lanes[corners])));
  _mm512_mask_storeu_epi32(to, static_cast<__mmask16>((1u << count) - 1),
                           _mm512_permutex2var_epi32(two_lines(0), lanes, two_lines(kBrickPoints)));
}
#endif

/// Writes the triangles of each brick. One team per brick.
struct EmitTriangles {
  static constexpr int kThreads = 128;
  /// The most triangles that are listed. A longer list would take shared memory from a GPU's cache.
  static constexpr int kListed = 432;
  struct Scratch {
    /// Per triangle of the brick: its row, its cell along x and its number in the cell
    /// (packed_triangle()). Used by a GPU alone.
    std::uint16_t listed[kListed];
    /// Index of the vertex on each crossed edge. Vectors are loaded beyond the last slot.
    std::uint32_t vertex[kLines * kLineSlots + 8];
    /// Number of triangles before each item of TeamCells (a row or a plane of cells, bricks.h).
    std::uint32_t before[kRows + 1];
    std::uint8_t inside[kLines];
    /// Rows and first vertex of this brick ([0]) and of the next bricks: bit 0 of the index is a
    /// step along x, bit 1 along y, bit 2 along z. Null rows: there is no such brick or the surface
    /// does not cross it, so that none of its vertices is needed.
    const std::uint32_t* rows[8];
    std::uint32_t first_vertex[8];
  };
  std::int64_t begin = 0;  ///< the first team's brick
  View<const BrickTable> table;
  Tree tree;
  View<const std::uint8_t> inside;
  View<const std::uint32_t> rows;
  View<const Counts> counts;  ///< per brick: its numbers of vertices and triangles
  View<const Offsets> first;  ///< per brick: its first vertex and triangle
  std::int64_t capacity = 0;  ///< bricks that the views above can hold
  View<Triangle> triangles;

  /// Finds the bricks that share edges with this one, finds the vertex on each crossed edge, counts
  /// the triangles before each item of TeamCells, and writes the triangles.
  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t team_index) const {
    const std::int64_t b = begin + team_index, first_triangle = first[b].triangles();
    // If the buffer is too small, the caller enlarges it and runs this pass again.
    if (counts[b].triangles() == 0 || first_triangle + counts[b].triangles() > triangles.size)
      return;
    using V = typename Team::V;
    using Cells = TeamCells<Team>;
    team.each(8, [&](int n) {
      const std::int64_t next = n == 0 ? b : tree.find_near(b, {n & 1, n >> 1 & 1, n >> 2});
      const bool crossed = next >= 0 && next < capacity && counts[next].vertices() != 0;
      scratch.rows[n] = crossed ? rows.data + next * kRows : nullptr;
      scratch.first_vertex[n] = crossed ? static_cast<std::uint32_t>(first[next].vertices()) : 0;
    });
    team.each(kLines, [&](int line) { scratch.inside[line] = inside[b * kLines + line]; });
    team.sync();
    team.each(kLines, [&](int line) { number_line<V>(scratch, line); });
    team.each(Cells::kItems, [&](int item) {
      scratch.before[item] = Cells(scratch.inside, item).triangles(table[0]);
    });
    team.sync();
    team.scan(scratch.before, Cells::kItems);
    if constexpr (Team::kGroup > 1) {
      const std::uint32_t count = counts[b].triangles();
      if (count <= kListed) {
        // Threads list the triangles of a row each, and then write one index each, side by side.
        team.each(Cells::kItems, [&](int row) { list<Cells>(scratch, row); });
        team.sync();
        auto* to = reinterpret_cast<std::uint32_t*>(triangles.data + first_triangle);
        team.each(3 * static_cast<int>(count),
                  [&](int i) { to[i] = listed_vertex<Cells>(scratch, i / 3, i % 3); });
        return;
      }
    }
    team.each(Cells::kItems, [&](int item) {
      emit<V, Cells>(scratch, item, triangles.data + first_triangle + scratch.before[item]);
    });
  }

  /// Stores the indices of the vertices on the edges that begin at the points of a line. Edges of
  /// the first seven points belong to this brick or, on the last lines, to the next brick along y
  /// or z. Edges of the eighth point belong to the next brick along x.
  template <class V>
  PM_HD void number_line(Scratch& scratch, int line) const {
    const int y = line % kBrickPoints, z = line / kBrickPoints;
    const int owner = (y == kBrickCells ? 2 : 0) + (z == kBrickCells ? 4 : 0);
    const int r = y % kBrickCells + kBrickCells * (z % kBrickCells);
    std::uint32_t* to = scratch.vertex + line * kLineSlots;
    if (scratch.rows[owner] != nullptr) {
      const std::uint32_t row = scratch.rows[owner][r];
      number_set_bits<V>(row_edges(row), scratch.first_vertex[owner] + vertices_before(row), to);
    }
    if (scratch.rows[owner + 1] != nullptr) {
      const std::uint32_t row = scratch.rows[owner + 1][r];
      const std::uint32_t vertex = scratch.first_vertex[owner + 1] + vertices_before(row);
      to += kRowEdges;
      // Only the row's first point is on this line. Its crossed edges, in the order x, y, z, have
      // the row's first vertices.
      to[0] = vertex, to[1] = vertex + (row & 1u), to[2] = to[1] + (row >> 1 & 1u);
    }
  }

  PM_HD static std::uint16_t packed_triangle(int row, int cell, int number) {
    return static_cast<std::uint16_t>(row << 6 | cell << 3 | number);
  }
  /// Lists the triangles of the cells of a row.
  template <class Cells>
  PM_HD void list(Scratch& scratch, int row) const {
    const Cells flags(scratch.inside, row);
    std::uint32_t at = scratch.before[row];
    for (auto cells = flags.mixed_cells(); cells != 0; cells &= cells - 1) {
      const int cell = countr_zero(cells), count = table[0].count[flags.corners(cell)];
      for (int i = 0; i < count; ++i) scratch.listed[at++] = packed_triangle(row, cell, i);
    }
  }
  /// Returns the index of a vertex (0 to 2) of a listed triangle.
  template <class Cells>
  PM_HD std::uint32_t listed_vertex(const Scratch& scratch, int triangle, int vertex) const {
    const int packed = scratch.listed[triangle], row = packed >> 6, cell = packed >> 3 & 7;
    const int slot =
        table[0].slots[Cells(scratch.inside, row).corners(cell)][3 * (packed & 7) + vertex];
    return scratch.vertex[Cells::first_line(row) * kLineSlots + 3 * cell + slot];
  }
  /// Writes the triangles of the cells of an item of TeamCells from `to` on.
  template <class V, class Cells>
  PM_HD void emit(const Scratch& scratch, int item, Triangle* to) const {
    const Cells flags(scratch.inside, item);
    const std::uint32_t* vertex = scratch.vertex + Cells::first_line(item) * kLineSlots;
    for (auto cells = flags.mixed_cells(); cells != 0; cells &= cells - 1) {
      const int cell = countr_zero(cells), corners = flags.corners(cell);
      const int count = table[0].count[corners];
      const int slot = cell / kBrickPoints * kLineSlots + 3 * (cell % kBrickPoints);
      write_cell_triangles<V>(vertex + slot, table[0], corners, 3 * count, to->v);
      to += count;
    }
  }
};

}  // namespace polymorph
