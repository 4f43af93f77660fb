#include "field/remove_detail.h"

#include <algorithm>
#include <cmath>

#include "base/array3.h"
#include "base/parallel.h"
#include "kernels/distance_field.h"

namespace polymorph {
namespace {

constexpr float kDeviation = 0.02f;  // as a fraction of the object's size

/// Passes a Gaussian, whose deviation is in points, along an axis. Beyond the border values stay.
void blur(Int3 n, int axis, float deviation, std::vector<float>& values) {
  const int reach = static_cast<int>(std::ceil(3 * deviation));
  std::vector<float> weights;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    const float x = static_cast<float>(i) / deviation;
    weights.push_back(std::exp(-0.5f * x * x));
    sum += weights.back();
  }
  const std::vector<float> before = values;
  parallel_for(n.z, [&](std::int64_t layer) {
    const int z = static_cast<int>(layer);
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) {
        float total = 0;
        for (int i = -reach; i <= reach; ++i) {
          Int3 at = {x, y, z};
          if (axis == 0) at.x = std::clamp(x + i, 0, n.x - 1);
          if (axis == 1) at.y = std::clamp(y + i, 0, n.y - 1);
          if (axis == 2) at.z = std::clamp(z + i, 0, n.z - 1);
          total += weights[static_cast<std::size_t>(i + reach)] * before[array3_index(n, at)];
        }
        values[array3_index(n, x, y, z)] = total / sum;
      }
  });
}

}  // namespace

DistanceGrid remove_detail(const DistanceGrid& distances, SmoothDistances spline,
                           const DistanceGrid& thinness, float size) {
  const float deviation = kDeviation * size / spline.grid.cell;
  for (const int axis : {0, 1, 2}) blur(spline.grid.points, axis, deviation, spline.values);
  const Grid& grid = distances.grid;
  DistanceGrid result{grid, evaluate_spline(spline, grid), 1};
  const DistanceField thin(thinness.grid, thinness.values.data());
  parallel_for(grid.points.z, [&](std::int64_t layer) {
    const int z = static_cast<int>(layer);
    for (int y = 0; y < grid.points.y; ++y)
      for (int x = 0; x < grid.points.x; ++x) {
        const Vec3 p = grid_point(grid, {x, y, z});
        // Thinness is negative beyond its grid.
        const float kept = std::clamp(thin.value(Points<float>{p.x, p.y, p.z}), 0.0f, 1.0f);
        float& value = result.values[array3_index(grid.points, x, y, z)];
        value += kept * (distances.values[array3_index(grid.points, x, y, z)] - value);
      }
  });
  close_border(result);
  bound_slopes(result);
  return result;
}

}  // namespace polymorph
