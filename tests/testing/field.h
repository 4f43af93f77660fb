// Gaussian balls with known surfaces, and values of distance grids.
#pragma once

#include <vector>

#include "field/distance_grid.h"
#include "kernels/distance_field.h"
#include "kernels/engine.h"

namespace polymorph {

inline Ball gaussian_ball(Vec3 center, float radius, float blobbiness = 2) {
  return {center, blobbiness / (radius * radius), blobbiness};
}

/// Returns the value of a grid of distances, or of thinness, at a point.
inline float at(const DistanceGrid& distances, Vec3 p) {
  return DistanceField(distances.grid, distances.values.data()).value(Points<float>{p.x, p.y, p.z});
}

}  // namespace polymorph
