// Triangle emission of marching cubes: the triangles of a brick's cells, with the indices of the
// vertices on their edges.
#pragma once

#include <cstdint>

#include "bricks.h"
#include "host_device.h"
#include "mc_tables.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// Writes the triangles of each brick. One team per brick.
struct EmitTriangles {
  static constexpr int kThreads = 128;
  struct Scratch {
    std::uint32_t vertex[kLines * kLineSlots];  ///< number of the vertex on each crossed edge
    std::uint32_t before[kRows + 1];            ///< triangles of lower rows
    std::uint8_t inside[kLines];
    std::int64_t next[8];  ///< this brick and the next ones: bit 0 along x, 1 along y, 2 along z
  };
  View<const BrickTable> table;
  Tree tree;
  View<const std::uint8_t> inside;
  View<const std::uint32_t> rows;
  View<const Counts> counts;
  View<const Offsets> first;  ///< vertex and triangle of each brick
  std::int64_t capacity = 0;  ///< bricks that the views above can hold
  View<Triangle> triangles;

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t b) const {
    const std::int64_t out = first[b].second;
    if (counts[b].second == 0 || out + counts[b].second > triangles.size) return;
    const Int3 at = tree.nodes[0][b].at;
    team.each(8, [&](int n) {
      scratch.next[n] =
          n == 0 ? b : tree.find({at.x + (n & 1), at.y + (n >> 1 & 1), at.z + (n >> 2)});
    });
    team.each(kLines, [&](int line) { scratch.inside[line] = inside[b * kLines + line]; });
    team.sync();
    team.each(kLines, [&](int line) { number_line(scratch, line); });
    team.each(kRows, [&](int r) {
      const RowFlags flags(scratch.inside, r);
      scratch.before[r] = static_cast<std::uint32_t>(flags.triangles(table[0]));
    });
    team.sync();
    team.scan(scratch.before, kRows);
    team.each(kRows,
              [&](int r) { emit_row(scratch, r, triangles.data + out + scratch.before[r]); });
  }

  /// The vertices on the edges from the points of a line: those of its first seven points in this
  /// brick or the next along y and z, that of the eighth beyond along x.
  PM_HD void number_line(Scratch& scratch, int line) const {
    const int y = line % kBrickPoints, z = line / kBrickPoints;
    const int beyond = (y == kBrickCells ? 2 : 0) + (z == kBrickCells ? 4 : 0);
    const int r = y % kBrickCells + kBrickCells * (z % kBrickCells);
    std::uint32_t* to = scratch.vertex + line * kLineSlots;
    number_edges(scratch.next[beyond], r, (1u << kRowEdges) - 1, to);
    number_edges(scratch.next[beyond + 1], r, 7u, to + kRowEdges);
  }

  PM_HD void number_edges(std::int64_t brick, int r, std::uint32_t wanted,
                          std::uint32_t* to) const {
    // Where there is no brick, or the surface does not cross it, nothing asks for these vertices.
    if (brick < 0 || brick >= capacity || counts[brick].first == 0) return;
    const std::uint32_t row = rows[brick * kRows + r];
    auto number = static_cast<std::uint32_t>(first[brick].first) + row_before(row);
    for (std::uint32_t edges = row_edges(row) & wanted; edges != 0; edges &= edges - 1) {
      to[countr_zero(edges)] = number++;
    }
  }

  PM_HD void emit_row(const Scratch& scratch, int r, Triangle* to) const {
    const RowFlags flags(scratch.inside, r);
    const std::uint32_t* line = scratch.vertex + line_of_row(r) * kLineSlots;
    for (std::uint32_t cells = flags.mixed(); cells != 0; cells &= cells - 1) {
      const int x = countr_zero(cells), corners = flags.corners(x);
      const std::uint8_t* slots = table[0].slots[corners];
      const std::uint32_t* vertex = line + 3 * x;
      for (int t = table[0].count[corners]; t > 0; --t, slots += 3, ++to) {
        *to = {{vertex[slots[0]], vertex[slots[1]], vertex[slots[2]]}};
      }
    }
  }
};

}  // namespace polymorph
