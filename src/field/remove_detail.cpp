#include "field/remove_detail.h"

#include <algorithm>

#include "base/array3.h"
#include "base/parallel.h"
#include "field/gaussian_filter.h"
#include "kernels/distance_field.h"
#include "kernels/simd_math.h"

namespace polymorph {
namespace {

// Standard deviation of the Gaussian filter, as a fraction of the object's size.
constexpr float kDeviation = 0.02f;

}  // namespace

DistanceGrid remove_detail(const DistanceGrid& distances, SmoothDistances spline,
                           const DistanceGrid& thinness, float size) {
  filter_gaussian(spline.grid.points, kDeviation * size / spline.grid.cell, spline.values);
  const Grid& grid = distances.grid;
  DistanceGrid result{grid, evaluate_spline(spline, grid), /*lipschitz=*/1};
  const DistanceField thin(thinness.grid, thinness.values.data());
  parallel_for(grid.points.z, [&](std::int64_t layer) {
    const int z = static_cast<int>(layer);
    for (int y = 0; y < grid.points.y; ++y)
      for (int x = 0; x < grid.points.x; x += Lanes<Pack>::kCount) {
        // Twice the thinness, clamped to [0, 1]: the field of thinness is negative beyond its grid.
        const Pack weights = min(max(2 * thin.value(line_points<Pack>(grid, {x, y, z})), Pack{}),
                                 broadcast<Pack>(1.0f));
        if (Lanes<Pack>::bits(weights > 0.0f) == 0) continue;
        const int count = std::min<int>(Lanes<Pack>::kCount, grid.points.x - x);
        const std::size_t first = array3_index(grid.points, x, y, z);
        for (int i = 0; i < count; ++i) {
          const std::size_t at = first + static_cast<std::size_t>(i);
          float& value = result.values[at];
          value += weights[i] * (distances.values[at] - value);
        }
      }
  });
  close_border(result);
  set_lipschitz(result);
  return result;
}

}  // namespace polymorph
