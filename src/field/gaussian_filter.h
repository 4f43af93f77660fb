// Gaussian filter of values on a grid.
#pragma once

#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// Filters values at the n.x * n.y * n.z points of a grid (x fastest) along each axis in turn.
/// Beyond the grid, the values on its border are repeated. `sigma` is in cells. Deterministic.
void filter_gaussian(Int3 n, float sigma, std::vector<float>& values);

}  // namespace polymorph
