// Surface roughness of a closed surface, independent of its triangulation: curvature, domes and
// grooves of the solid smoothed a little, and how far the surface is from the solid smoothed more.
// Formulas: docs/method.md, Quality.
#pragma once

#include "base/box.h"
#include "kernels/mesh.h"

namespace polymorph {

/// What the roughness of all frames of a morph is measured by.
struct RoughnessScale {
  double size = 1;     ///< L: the diagonal of the box of both ends
  double cell = 0.01;  ///< edge of the cells that the solid is cut into
};

/// `resolution` cells along the longest side of the box of both ends.
RoughnessScale roughness_scale(const Box& ends, int resolution = 104);

/// All without a unit; 0 for a solid below eight cells.
struct Roughness {
  /// Total absolute curvature (Chern and Lashof 1957): the integral of the absolute value of the
  /// Gaussian curvature over 4 pi, of the solid smoothed with a Gaussian of 1 % of L. 1 for what is
  /// convex, else more, at least 1 + genus; every bump adds about 1. With 104 cells differences
  /// from cell to cell give 0.95 for a sphere, with 208 0.985.
  double tac = 0;
  int bumps = 0;      ///< connected domes of that surface, both radii of curvature below 6 % of L
  double groove = 0;  ///< share of its area, in per cent, concave with a radius below 6 % of L
  /// RMS distance, in per cent of L, of the surface from that of the solid smoothed with 2 % of L;
  /// distances above 2 % of L count as these.
  double rho = 0;
};

/// Of a closed, outward mesh; where it is open, it is left out. Deterministic. Cells are larger
/// where the box of the mesh would have more than 256 per side.
Roughness roughness_of(const Mesh& mesh, const RoughnessScale& scale);

}  // namespace polymorph
