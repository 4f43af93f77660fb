// Thin parts of signed distances: thickening and smoothing, so that extraction shows them whole.
#pragma once

#include "kernels/morph_surface.h"
#include "model/model.h"

namespace polymorph {

/// Radius to which thin parts are thickened, relative to `thinnest`, the radius of the thinnest
/// visible part. It is above 1 because the smoothing that follows makes them thinner again.
inline constexpr float kThickening = 1.35f;

/// Changes distances near thin parts and narrow gaps so that cells of about `thinnest` (a radius,
/// scene units) do not show fragments of them: walls are thickened, then the distances there pass a
/// Gaussian low-pass filter. Edges elsewhere stay unchanged.
void smooth_thin_parts(const Model& model, float thinnest, DistanceGrid& distances);

}  // namespace polymorph
