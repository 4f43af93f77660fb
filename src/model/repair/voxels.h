// Voxelization, exact distance transform and surface nets: finds the voxels that a ball cannot
// reach from outside, and makes a surface around them.
#pragma once

#include <cstdint>
#include <vector>

#include "base/array3.h"
#include "kernels/types.h"
#include "mesh/closest.h"
#include "model/model.h"

namespace polymorph {

/// Voxels: grid points, each solid or empty.
struct Voxels {
  Grid grid;
  /// Depth of each point below the solid's boundary in cells, negative outside. It is that of the
  /// solid before make_manifold(), which changes `solid` only.
  std::vector<float> depth;
  std::vector<std::uint8_t> solid;  ///< one per point: 1 solid, 0 empty
  std::size_t index(int x, int y, int z) const { return array3_index(grid.points, x, y, z); }
  std::size_t count() const { return solid.size(); }
};

/// Computes the distance, in cells, of each grid point to the nearest one whose `seed` is not 0
/// (exact; Felzenszwalb and Huttenlocher 2012); infinity without seeds.
std::vector<float> compute_distances(const Grid& grid, const std::vector<std::uint8_t>& seed);

/// Makes a grid around a model with a margin in which a ball of the given radius can move freely.
/// Cell and radius are in model units.
Grid make_grid_around(const Box& box, float cell, float radius);

/// Marks the grid points within 0.87 cells (half a cell's diagonal) of the surface.
std::vector<std::uint8_t> mark_wall_points(const Grid& grid, const ClosestPointQuery& surface);

/// Finds the voxels that a ball of this radius (model units) cannot reach when it moves in from the
/// border without touching wall points (`wall_distances`: distances to them, in cells). The result
/// is eroded by one cell, so that the wall's own cells alone make no solid.
Voxels find_unreachable(const Grid& grid, const std::vector<float>& wall_distances, float radius);

/// Removes components smaller than a thousandth of the largest; then fills voxels until in each
/// cell (of eight grid points) the solid corners are connected, and the empty ones, too. This makes
/// the surface around them manifold.
void make_manifold(Voxels& voxels);

struct VoxelSurface {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
};

/// Makes surface nets (Gibson 1998): a vertex for each cell, and a quad of two triangles for each
/// edge, that has both solid and empty grid points. The surface is closed and faces outward if the
/// border of the grid is empty; it is manifold after make_manifold().
VoxelSurface make_surface_nets(const Voxels& voxels);

}  // namespace polymorph
