// Signed distance fields of models on grids, for surfaces between two objects (docs/method.md,
// Surface between).
#pragma once

#include <span>
#include <vector>

#include "kernels/morph_surface.h"
#include "mesh/closest.h"
#include "mesh/inside.h"
#include "model/model.h"
#include "model/repair/face_sides.h"

namespace polymorph {

/// Coefficients of a quadratic B-spline that represents the distances far from the surface.
struct SmoothDistances {
  Grid grid;  ///< every fourth point of the fine grid, from the first to the last
  std::vector<float> values;
};
/// Evaluates the spline at a finer grid's points.
std::vector<float> evaluate_spline(const SmoothDistances& smooth, const Grid& fine);
/// Lowers the values on the grid's border to minus one cell or less (outside).
void close_border(DistanceGrid& distances);
/// Sets the Lipschitz constant: a bound of the trilinear interpolant's gradient. Along an axis,
/// within a cell, its derivative lies between those of the cell's edges.
void bound_slopes(DistanceGrid& distances);

/// Maximum number of cells along the longest side of a model.
inline constexpr int kMaxDistanceCells = 256;

/// Radius, in cells, of the thinnest part that extraction shows without gaps; passed to
/// compute_signed_distances() as `thinnest`.
inline constexpr float kThinnestPart = 0.9f;

/// Makes the grid for the signed distances of a model in `box`, with a margin. The cell is `cell`
/// or a 256th of the longest side, whichever is larger.
Grid make_distance_grid(const Box& box, float cell);

/// A model, with queries on it and the sides of its faces.
struct QueriedModel {
  const Model& model;
  const InsideTest& inside;
  const ClosestPointQuery& closest;
  std::span<const FaceSide> sides;  ///< results of classify_faces()
  Box box;                          ///< bounds that the grid surrounds, usually those of the model
};

/// Computes signed distances to the model on the grid of make_distance_grid(). They are exact
/// within two cells of the surface; over two more cells they blend into a smooth field (a quadratic
/// B-spline over every fourth point), which rounds the ridges half way between faces. Faces inside
/// the solid (inside on both sides) do not count. Parts thinner than 2 `thinnest`, also sheets
/// without an inside, are thickened to that, so that cells of about that size show them without
/// gaps; thin parts, narrow gaps and sharp edges are smoothed over about `thinnest`. With
/// `thinnest` = 0 there is neither. A model that consists of sheets has no inside.
/// `smooth`, if given, receives the spline. Deterministic.
DistanceGrid compute_signed_distances(const QueriedModel& queried, float cell, float thinnest,
                                      SmoothDistances* smooth = nullptr);

}  // namespace polymorph
