// Signed distance fields of models on grids, for surfaces between two objects (docs/method.md,
// Surface between).
#pragma once

#include "kernels/morph_surface.h"
#include "model/closest.h"
#include "model/inside.h"
#include "model/model.h"

namespace polymorph {

/// Signed distances to the model on cells of edge `cell` or the smallest of which 256 go along the
/// longest side, whichever is larger. Exact within two cells of the surface; from there on they
/// fade, over two cells more, into a smooth field (a quadratic B-spline over every fourth point),
/// so that ridges half way between faces are rounded. Faces that the solid hides (inside on both
/// sides) do not count. Parts thinner than 2 `thinnest` are as thick as that, sheets without an
/// inside among them, so that cells of about that size show them whole; thin parts, narrow gaps and
/// sharp edges are smoothed over about `thinnest`. 0 leaves all as it is.
///
/// `inside` and `closest` are of the model. Deterministic.
DistanceGrid signed_distances(const Model& model, const InsideTest& inside,
                              const ClosestPointQuery& closest, float cell, float thinnest);

}  // namespace polymorph
