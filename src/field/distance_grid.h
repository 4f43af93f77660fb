// Signed distance fields of models on grids (positive inside), for surfaces between two objects
// (docs/method.md, Surface between).
#pragma once

#include <span>
#include <vector>

#include "kernels/morph_surface.h"
#include "mesh/closest.h"
#include "mesh/inside.h"
#include "model/model.h"
#include "model/repair/face_classes.h"

namespace polymorph {

/// Coefficients of a quadratic B-spline that represents the distances far from the surface.
struct SmoothDistances {
  Grid grid;  ///< every fourth point of the distances' grid, from the first to the last
  std::vector<float> values;  ///< one coefficient per point of `grid`
};
/// Evaluates the spline at all points of `fine`, the distances' grid.
std::vector<float> evaluate_spline(const SmoothDistances& smooth, const Grid& fine);
/// Evaluates it at the points of the layers from `begin` to before `end` along z; `values` has room
/// for them.
void evaluate_spline_layers(const SmoothDistances& smooth, const Grid& fine, int begin, int end,
                            float* values);
/// Lowers the values on the grid's border to at most -grid.cell, so that the border is outside.
void close_border(DistanceGrid& distances);
/// Does so in layer `z`, whose values these are.
void close_border(const Grid& grid, int z, float* layer);
/// Sets DistanceGrid::lipschitz to a bound, at least 1, of the length of the trilinear
/// interpolant's gradient. Within a cell, the derivative along an axis lies between the differences
/// along the cell's four edges of that direction.
void set_lipschitz(DistanceGrid& distances);

/// Maximum number of cells along the longest side of a model.
inline constexpr int kMaxDistanceCells = 256;

/// Radius of the thinnest part that extraction shows without gaps, in cells of the extraction.
/// Multiply by the edge of these cells for the argument `thinnest` of compute_signed_distances().
inline constexpr float kThinnestPart = 0.9f;

/// Makes the grid for the signed distances of a model in `box`, with a margin. The cells' edge is
/// `cell` or the longest side over kMaxDistanceCells, whichever is larger.
Grid make_distance_grid(const Box& box, float cell);

/// A model, with queries on it and the classification of its faces.
struct QueriedModel {
  const Model& model;
  const InsideTest& inside;
  const ClosestPointQuery& closest;
  std::span<const FaceClass> face_classes;  ///< results of classify_faces()
  Box box;  ///< bounds that the grid surrounds, usually those of the model
};

/// Computes signed distances to the model on the grid of make_distance_grid(). They are exact
/// within two cells of the surface; over two more cells they blend into a smooth field (a quadratic
/// B-spline over every fourth point), which rounds the ridges half way between faces. Faces inside
/// the solid (FaceClass::kHidden) are ignored. If all faces are FaceClass::kSheet, nothing is
/// inside.
///
/// `thinnest`: a radius, scene units. Parts and sheets thinner than 2 `thinnest` are thickened to
/// that thickness, so that cells of about that size show them without gaps. Thin parts, narrow gaps
/// and sharp edges are smoothed over about `thinnest`. 0: nothing is thickened or smoothed.
///
/// `smooth`, if given, receives the spline. Deterministic.
DistanceGrid compute_signed_distances(const QueriedModel& queried, float cell, float thinnest,
                                      SmoothDistances* smooth = nullptr);

}  // namespace polymorph
