#include "field/gaussian_filter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "base/exact_math.h"
#include "base/parallel.h"

namespace polymorph {

void filter_gaussian(Int3 n, float sigma, std::vector<float>& values) {
  // Weights beyond 2.5 deviations, below 5 % of the largest, are left out.
  const int radius = static_cast<int>(std::ceil(2.5f * sigma));
  std::vector<float> weights;
  float sum = 0;
  for (int i = -radius; i <= radius; ++i) {
    const double t = i / static_cast<double>(sigma);
    weights.push_back(static_cast<float>(exact::exp(-0.5 * t * t)));
    sum += weights.back();
  }
  for (float& w : weights) w /= sum;
  const auto row = static_cast<std::size_t>(n.x), layer = row * static_cast<std::size_t>(n.y);
  // Filters along x: each line is copied with its ends repeated `radius` times.
  parallel_for(
      std::int64_t{n.y} * n.z,
      [&](std::int64_t l) {
        float* line = values.data() + static_cast<std::size_t>(l) * row;
        const auto margin = static_cast<std::size_t>(radius);
        std::vector<float> copy(row + 2 * margin, line[0]);
        std::copy_n(line, row, copy.data() + margin);
        std::fill_n(copy.data() + margin + row, margin, line[row - 1]);
        std::fill_n(line, row, 0.0f);
        for (std::size_t k = 0; k < weights.size(); ++k)
          for (std::size_t x = 0; x < row; ++x) line[x] += weights[k] * copy[x + k];
      },
      /*grain=*/16);
  // Filters along y or z: replaces each row of a plane by a weighted sum of whole rows, so that
  // memory is read in order. A plane has `count` rows, which begin `step` values apart.
  const auto filter_planes = [&](int planes, std::size_t plane_stride, int count,
                                 std::size_t step) {
    parallel_for(planes, [&](std::int64_t p) {
      float* plane = values.data() + static_cast<std::size_t>(p) * plane_stride;
      std::vector<float> copy(static_cast<std::size_t>(count) * row);
      for (int i = 0; i < count; ++i)
        std::copy_n(plane + static_cast<std::size_t>(i) * step, row,
                    copy.data() + static_cast<std::size_t>(i) * row);
      for (int i = 0; i < count; ++i) {
        float* to = plane + static_cast<std::size_t>(i) * step;
        std::fill_n(to, row, 0.0f);
        for (int k = -radius; k <= radius; ++k) {
          const float w = weights[static_cast<std::size_t>(k + radius)];
          const float* from =
              copy.data() + static_cast<std::size_t>(std::clamp(i + k, 0, count - 1)) * row;
          for (std::size_t x = 0; x < row; ++x) to[x] += w * from[x];
        }
      }
    });
  };
  filter_planes(n.z, layer, n.y, row);  // along y
  filter_planes(n.y, row, n.z, layer);  // along z
}

}  // namespace polymorph
