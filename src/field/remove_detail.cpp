#include "field/remove_detail.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "base/array3.h"
#include "base/parallel.h"
#include "field/gaussian_filter.h"
#include "kernels/distance_field.h"
#include "kernels/simd_math.h"

namespace polymorph {
namespace {

// Standard deviation of the Gaussian filter, as a fraction of the object's size.
constexpr float kDeviation = 0.02f;

/// Indices of points along a line.
struct LineRange {
  int begin = 0, end = 0;
};

/// Finds for each line along x of the thinness grid the range of points that are thin.
std::vector<LineRange> find_thin_ranges(const DistanceGrid& thinness) {
  const Int3 n = thinness.grid.points;
  std::vector<LineRange> ranges;
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y) {
      LineRange range{n.x, 0};
      for (int x = 0; x < n.x; ++x) {
        if (!(thinness.values[array3_index(n, x, y, z)] > 0)) continue;
        range.begin = std::min(range.begin, x);
        range.end = x + 1;
      }
      ranges.push_back(range);
    }
  return ranges;
}

/// Returns a range that contains all points of a line of `grid`, along x at (y, z), where the
/// thinness, which is interpolated, is positive. `ranges`: find_thin_ranges().
LineRange thin_points(const Grid& grid, int y, int z, const Grid& thinness,
                      std::span<const LineRange> ranges) {
  // One cell more on each side than interpolation reads makes up for rounding.
  const Vec3 position = (grid_point(grid, {0, y, z}) - thinness.origin) / thinness.cell;
  const auto neighbors = [](float at, int count) {
    const int cell = static_cast<int>(std::floor(at));
    return LineRange{std::clamp(cell - 1, 0, count), std::clamp(cell + 3, 0, count)};
  };
  const LineRange rows = neighbors(position.y, thinness.points.y),
                  layers = neighbors(position.z, thinness.points.z);
  LineRange coarse{thinness.points.x, 0};
  for (int k = layers.begin; k < layers.end; ++k)
    for (int j = rows.begin; j < rows.end; ++j) {
      const LineRange& range = ranges[static_cast<std::size_t>(k * thinness.points.y + j)];
      coarse.begin = std::min(coarse.begin, range.begin);
      coarse.end = std::max(coarse.end, range.end);
    }
  if (coarse.begin >= coarse.end) return {};
  const float step = thinness.cell / grid.cell;  // points of `grid` in a cell of the thinness
  const float first = (static_cast<float>(coarse.begin - 2) - position.x) * step,
              last = (static_cast<float>(coarse.end + 1) - position.x) * step;
  return {std::clamp(static_cast<int>(std::floor(first)), 0, grid.points.x),
          std::clamp(static_cast<int>(std::ceil(last)) + 1, 0, grid.points.x)};
}

}  // namespace

DistanceGrid remove_detail(const DistanceGrid& distances, SmoothDistances spline,
                           const DistanceGrid& thinness, float size) {
  filter_gaussian(spline.grid.points, kDeviation * size / spline.grid.cell, spline.values);
  const Grid& grid = distances.grid;
  DistanceGrid result{grid, evaluate_spline(spline, grid), /*lipschitz=*/1};
  const DistanceField thin(thinness.grid, thinness.values.data());
  const std::vector<LineRange> thin_ranges = find_thin_ranges(thinness);
  parallel_for(grid.points.z, [&](std::int64_t layer) {
    const int z = static_cast<int>(layer);
    for (int y = 0; y < grid.points.y; ++y) {
      const LineRange range = thin_points(grid, y, z, thinness.grid, thin_ranges);
      for (int x = range.begin; x < range.end; x += Lanes<Pack>::kCount) {
        // Twice the thinness, clamped to [0, 1]: the field of thinness is negative beyond its grid.
        const Pack weights = min(max(2 * thin.value(line_points<Pack>(grid, {x, y, z})), Pack{}),
                                 broadcast<Pack>(1.0f));
        if (Lanes<Pack>::bits(weights > 0.0f) == 0) continue;
        const int count = std::min<int>(Lanes<Pack>::kCount, range.end - x);
        const std::size_t first = array3_index(grid.points, x, y, z);
        for (int i = 0; i < count; ++i) {
          const std::size_t at = first + static_cast<std::size_t>(i);
          float& value = result.values[at];
          value += weights[i] * (distances.values[at] - value);
        }
      }
    }
  });
  close_border(result);
  set_lipschitz(result);
  return result;
}

}  // namespace polymorph
