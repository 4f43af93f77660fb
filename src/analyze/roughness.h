// Roughness of a closed surface, independent of its triangulation: curvature, domes and grooves of
// the slightly smoothed solid, and the distance of the surface from the more smoothed solid.
// Formulas: docs/method.md, Quality.
#pragma once

#include "base/box.h"
#include "kernels/mesh.h"

namespace polymorph {

/// The units in which the roughness of all frames of a morph is measured.
struct RoughnessScale {
  double size = 1;     ///< L: diagonal of the bounding box of the first and the last frame
  double cell = 0.01;  ///< edge length of the cells of the occupancy grid
};

/// Returns a scale with `resolution` cells along the longest side of `ends`, the box of the first
/// and the last frame.
RoughnessScale roughness_scale(const Box& ends, int resolution = 104);

/// Roughness measures without a unit; all are 0 for a solid with less volume than eight cells.
struct Roughness {
  /// Total absolute curvature (Chern and Lashof 1957): the integral of the absolute value of the
  /// Gaussian curvature over 4 pi, of the solid smoothed with a Gaussian of 1 % of L. It is 1 for
  /// a convex solid and at least 1 + genus otherwise; every bump adds about 1. Finite differences
  /// on 104 cells give 0.95 for a sphere, on 208 cells 0.985.
  double tac = 0;
  /// Number of connected domes of the smoothed surface. On a dome both radii of curvature are below
  /// 6 % of L. Domes below 1e-4 L^2 are noise and do not count.
  int bumps = 0;
  /// Percentage of the smoothed surface's area that is concave with a radius below 6 % of L.
  double groove = 0;
  /// RMS distance, in per cent of L, of the surface from the surface of the solid smoothed with a
  /// Gaussian of 2 % of L. Larger distances are clamped to 2 % of L.
  double rho = 0;
};

/// Measures the roughness of a closed mesh with outward normals, deterministically. Scanlines
/// through holes of an open mesh are left out. Cells are enlarged where the box of the mesh would
/// have more than 256 per side.
Roughness measure_roughness(const Mesh& mesh, const RoughnessScale& scale);

}  // namespace polymorph
