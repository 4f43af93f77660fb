// Volume of the convex hull of points (Quickhull; Barber, Dobkin and Huhdanpaa 1996).
#pragma once

#include <span>

#include "kernels/types.h"

namespace polymorph {

/// Computes the volume of the points' convex hull; 0 if they lie in a plane. Deterministic.
double hull_volume(std::span<const Vec3> points);

}  // namespace polymorph
