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

/// Coefficients of a quadratic B-spline: distances far from the surface.
struct SmoothDistances {
  Grid grid;  ///< every fourth point of the fine one, from the first to beyond the last
  std::vector<float> values;
};
/// The spline at a finer grid's points.
std::vector<float> spline_values(const SmoothDistances& smooth, const Grid& fine);
/// Makes the points on the border outside, by a cell at least.
void close_border(DistanceGrid& distances);
/// Sets the Lipschitz constant: the largest gradient of the trilinear function, which along each
/// axis, within a cell, lies between those of the cell's edges.
void bound_slopes(DistanceGrid& distances);

/// Cells along the longest side of a model, at most.
inline constexpr int kMaxDistanceCells = 256;

/// The radius of the thinnest part of a model that all cells of its surface see, in cells: what
/// signed_distances() is given as `thinnest`.
inline constexpr float kThinnestPart = 0.9f;

/// The grid of signed distances to a model in `box`: cells of edge `cell` or the smallest of which
/// 256 go along the longest side, whichever is larger, and a margin around.
Grid distance_grid(const Box& box, float cell);

/// Signed distances to the model on the grid that distance_grid() gives. Exact
/// within two cells of the surface; from there on they fade, over two cells more, into a smooth
/// field (a quadratic B-spline over every fourth point), so that ridges half way between faces are
/// rounded. Faces that the solid hides (inside on both sides) do not count. Parts thinner than 2
/// `thinnest` are as thick as that, sheets without an inside among them, so that cells of about
/// that size show them whole; thin parts, narrow gaps and sharp edges are smoothed over about
/// `thinnest`. 0 leaves all as it is.
///
/// A model of sheets alone has no inside.
///
/// `inside`, `closest` and `sides` (classify_faces()) are of the model. `smooth`, where given, gets
/// what the values are far from the surface. Deterministic.
DistanceGrid signed_distances(const Model& model, const InsideTest& inside,
                              const ClosestPointQuery& closest, std::span<const FaceSide> sides,
                              float cell, float thinnest, SmoothDistances* smooth = nullptr);

}  // namespace polymorph
