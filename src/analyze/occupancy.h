// Occupancy grids: the fraction of each grid cell that a closed surface encloses, Gaussian
// smoothing, and extraction of isosurfaces. Measures on such grids do not depend on how a surface
// was made or triangulated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array3.h"
#include "base/box.h"
#include "kernels/mesh.h"
#include "kernels/types.h"

namespace polymorph {

/// A value per cell of a box of cubic cells; z runs fastest, then y, then x.
struct CellValues {
  double cell = 1;  ///< edge length of a cell
  Int3 cells;       ///< number of cells along each axis
  std::vector<float> values;
  std::size_t index(int x, int y, int z) const {
    return array3_index({cells.z, cells.y, cells.x}, z, y, x);
  }
};

/// Computes the fraction of each cell, in [0, 1], that lies inside a closed mesh with outward
/// normals. Two by two scanlines along z sample each cell; the fraction along a scanline is exact.
/// Scanlines with different numbers of entries and exits cross a hole of the mesh and are left out.
/// The grid covers the bounding box of the mesh with `margin` around it; `cell` and `margin` are in
/// units of the mesh. An empty mesh has no cells.
CellValues compute_occupancy(const Mesh& mesh, double cell, double margin);

/// Sums the values of all cells: the enclosed volume, in cells.
double sum_values(const CellValues& values);

/// Convolves the values with a Gaussian of standard deviation `sigma` cells, cut off at `cutoff`
/// times sigma and normalized to sum 1. Cells outside the box count as 0.
CellValues smooth(const CellValues& values, double sigma, double cutoff);

/// Returns the value that `count` cells exceed: the level of the isosurface that encloses that
/// volume. It is 0 if fewer cells have a value above 0.
float find_level_of_volume(const CellValues& values, double count);

/// A surface in units of cells; the origin is the center of the first cell.
struct IsoSurface {
  std::vector<Vec3> positions;
  /// Every vertex lies between the center of a cell and that of the next cell along an axis; these
  /// are the cell and the axis (0, 1 or 2) of each vertex.
  std::vector<Int3> vertex_cell;
  std::vector<std::uint8_t> vertex_axis;
  std::vector<Triangle> triangles;
};

/// Extracts an isosurface by marching cubes over the cell centers, with linear interpolation
/// between them. Values above `level` are inside. The cells on the border must be outside.
IsoSurface extract_iso_surface(const CellValues& values, float level);

/// Returns a third of the area of the triangles around each vertex, in squared cells.
std::vector<double> vertex_areas(const IsoSurface& surface);

}  // namespace polymorph
