#include "field/remove_detail.h"

#include <algorithm>

#include "base/array3.h"
#include "base/parallel.h"
#include "field/gaussian_filter.h"
#include "kernels/distance_field.h"

namespace polymorph {
namespace {

constexpr float kDeviation = 0.02f;  // of the Gaussian filter, as a fraction of the object's size

}  // namespace

DistanceGrid remove_detail(const DistanceGrid& distances, SmoothDistances spline,
                           const DistanceGrid& thinness, float size) {
  filter_gaussian(spline.grid.points, kDeviation * size / spline.grid.cell, spline.values);
  const Grid& grid = distances.grid;
  DistanceGrid result{grid, evaluate_spline(spline, grid), 1};
  const DistanceField thin(thinness.grid, thinness.values.data());
  parallel_for(grid.points.z, [&](std::int64_t layer) {
    const int z = static_cast<int>(layer);
    for (int y = 0; y < grid.points.y; ++y)
      for (int x = 0; x < grid.points.x; ++x) {
        const Vec3 p = grid_point(grid, {x, y, z});
        // Thinness is negative beyond its grid.
        const float weight = std::clamp(2 * thin.value(Points<float>{p.x, p.y, p.z}), 0.0f, 1.0f);
        float& value = result.values[array3_index(grid.points, x, y, z)];
        value += weight * (distances.values[array3_index(grid.points, x, y, z)] - value);
      }
  });
  close_border(result);
  set_lipschitz(result);
  return result;
}

}  // namespace polymorph
