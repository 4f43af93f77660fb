// Occupancy grids: a closed surface as the fraction of each grid cell that it encloses, Gaussian
// smoothing, and an isosurface back. Measures on them do not depend on how a surface was made or
// triangulated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/box.h"
#include "kernels/mesh.h"
#include "kernels/types.h"

namespace polymorph {

/// A value per cell of a box of cubic cells; z runs fastest, then y, then x.
struct CellValues {
  double cell = 1;  ///< edge of a cell
  Int3 cells;       ///< how many along each axis
  std::vector<float> values;
  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(x) * static_cast<std::size_t>(cells.y) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(cells.z) +
           static_cast<std::size_t>(z);
  }
};

/// The share of each cell that lies inside a closed, outward mesh, in [0, 1]: exact along z in two
/// by two lines per cell. Lines that enter and leave unequally often (the mesh is open there) do
/// not count. The grid is the mesh's box with `margin` around it.
CellValues occupancy_of(const Mesh& mesh, double cell, double margin);

/// Of all cells together, in cells.
double sum_of(const CellValues& values);

/// Convolved with a Gaussian of standard deviation `sigma` cells, cut off at `reach` times sigma
/// and then of sum 1; 0 outside the box.
CellValues smoothed(const CellValues& values, double sigma, double reach);

/// The value that `count` cells exceed: the level of the surface that encloses that volume. 0 where
/// fewer cells have a value above 0.
float level_of_volume(const CellValues& values, double count);

/// A surface in units of cells, the middle of the first cell being the origin.
struct IsoSurface {
  std::vector<Vec3> positions;
  /// Every vertex lies on the line from the middle of a cell to that of the next one along an axis:
  /// which cell, and which axis (0, 1, 2).
  std::vector<Int3> from;
  std::vector<std::uint8_t> axis;
  std::vector<Triangle> triangles;
};

/// Marching cubes over the middles of the cells, values linear between them; larger than `level` is
/// inside. The cells on the border must be outside.
IsoSurface iso_surface(const CellValues& values, float level);

/// A third of the area of the triangles around each vertex, in squared cells.
std::vector<double> vertex_areas(const IsoSurface& surface);

}  // namespace polymorph
