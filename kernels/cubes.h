// Voxel surface ("matrix skin", section 2.1.2.1 of Gilbert 2010; docs/method.md): every inside
// point of the grid is a cube of one cell, of which the faces towards outside points are drawn.
#pragma once

#include <cstdint>

#include "bricks.h"
#include "host_device.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// Writes one square, with four vertices and a flat normal of its own, across each crossed edge of
/// each brick. One team per brick. Members as in EmitTriangles (triangles.h).
struct EmitCubes {
  static constexpr int kThreads = 64;
  struct Scratch {
    char unused;
  };
  Grid grid;
  View<const Node> bricks;
  View<const std::uint8_t> inside;
  View<const std::uint32_t> rows;
  View<const Counts> counts;
  View<const Offsets> first;
  View<Vec3> positions;
  View<Vec3> normals;
  View<Triangle> triangles;

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch&, std::int64_t b) const {
    const std::int64_t vertex = first[b].vertices(), triangle = first[b].triangles();
    if (counts[b].vertices() == 0 || vertex + counts[b].vertices() > positions.size ||
        vertex + counts[b].vertices() > normals.size ||
        triangle + counts[b].triangles() > triangles.size) {
      return;  // a buffer is too small; the caller enlarges it and runs this pass again
    }
    const Int3 at = bricks[b].at;
    team.each(kRows, [&](int r) {
      const std::uint32_t row = rows[b * kRows + r];
      const std::uint32_t flags = inside[b * kLines + line_of_row(r)];
      // Each crossed edge has one square, so the row's first square has the number of crossed edges
      // before this row. In marching cubes, this is the number of vertices before the row.
      std::int64_t face = vertices_before(row);
      for (std::uint32_t edges = row_edges(row); edges != 0; edges &= edges - 1, ++face) {
        // Bit 3 x + axis is the edge from point x along `axis`. Bricks begin one point before their
        // first cell.
        const int bit = countr_zero(edges), x = bit / 3;
        const Int3 p = {at.x * kBrickCells + x - 1, at.y * kBrickCells + r % kBrickCells - 1,
                        at.z * kBrickCells + r / kBrickCells - 1};
        emit(p, bit % 3, (flags >> x & 1u) != 0, vertex + kFaceVertices * face,
             triangle + kFaceTriangles * face);
      }
    });
  }

  /// Writes the square across the edge from grid point p along `axis`. `upward`: p is inside, so
  /// that the normal points along the axis.
  PM_HD void emit(Int3 p, int axis, bool upward, std::int64_t vertex, std::int64_t triangle) const {
    // The corners are counter-clockwise as seen from the upper end of the edge. Their order is
    // reversed if that end is inside.
    const float corner_offsets[4][2] = {{-0.5f, -0.5f}, {0.5f, -0.5f}, {0.5f, 0.5f}, {-0.5f, 0.5f}};
    const float sign = upward ? 1.0f : -1.0f;
    const Vec3 normal = {axis == 0 ? sign : 0.0f, axis == 1 ? sign : 0.0f, axis == 2 ? sign : 0.0f};
    for (int i = 0; i < 4; ++i) {
      const int corner = upward ? i : 3 - i;
      const float u = corner_offsets[corner][0], v = corner_offsets[corner][1];
      const Vec3 shift = axis == 0   ? Vec3{0.5f, u, v}
                         : axis == 1 ? Vec3{v, 0.5f, u}
                                     : Vec3{u, v, 0.5f};
      positions[vertex + i] = {grid.origin.x + grid.cell * (static_cast<float>(p.x) + shift.x),
                               grid.origin.y + grid.cell * (static_cast<float>(p.y) + shift.y),
                               grid.origin.z + grid.cell * (static_cast<float>(p.z) + shift.z)};
      normals[vertex + i] = normal;
    }
    const auto v = static_cast<std::uint32_t>(vertex);
    triangles[triangle] = {{v, v + 1, v + 2}};
    triangles[triangle + 1] = {{v, v + 2, v + 3}};
  }
};

}  // namespace polymorph
