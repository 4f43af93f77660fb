// Gaussian filter of values on a grid.
#pragma once

#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// Filters values at the points of a grid (x fastest) along each axis in turn, with the border
/// repeated; `sigma` is in cells. Deterministic.
void filter_gaussian(Int3 n, float sigma, std::vector<float>& values);

}  // namespace polymorph
