// Voxelization, exact distance transform and surface nets: the voxels that a ball cannot reach from
// outside, and a surface around them.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/types.h"
#include "mesh/closest.h"
#include "model/model.h"

namespace polymorph {

/// Points of a grid, each in or out; `level` is 0 at the boundary of the set that it was cut from
/// and grows inward, in cells.
struct Voxels {
  Grid grid;
  std::vector<float> level;
  std::vector<std::uint8_t> solid;
  std::size_t index(int x, int y, int z) const {
    return static_cast<std::size_t>(x) +
           static_cast<std::size_t>(grid.points.x) *
               (static_cast<std::size_t>(y) +
                static_cast<std::size_t>(grid.points.y) * static_cast<std::size_t>(z));
  }
  std::size_t count() const { return solid.size(); }
};

/// Distance, in cells, of each grid point to the nearest one with `seed` (Felzenszwalb and
/// Huttenlocher 2012, exact); infinity without seeds.
std::vector<float> distances_to(const Grid& grid, const std::vector<std::uint8_t>& seed);

/// The grid around a model whose border a ball of the given radius reaches freely.
Grid grid_around(const Box& box, float cell, float radius);

/// 1 for the grid points within 0.87 cells (half a cell's diagonal) of the surface.
std::vector<std::uint8_t> wall_points(const Grid& grid, const ClosestPointQuery& surface);

/// What no ball of this radius, kept off the wall points (`from_wall`: their distances), reaches
/// from the border, less one cell: what only the wall's own cells make up is left out.
Voxels unreachable(const Grid& grid, const std::vector<float>& from_wall, float radius);

/// Fills voxels until each cell of eight has its solid and its empty corners in one piece each:
/// only then is the surface around them manifold. Drops pieces smaller than a thousandth of the
/// largest first.
void make_manifold(Voxels& voxels);

struct VoxelSurface {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
};

/// Surface nets (Gibson 1998): a vertex per mixed cell, four-sided faces across mixed edges, cut in
/// two. Closed and outward if the border is empty; manifold after make_manifold().
VoxelSurface surface_nets(const Voxels& voxels);

}  // namespace polymorph
