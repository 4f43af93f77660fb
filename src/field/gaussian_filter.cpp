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
  // Filters along one axis. A line consists of `count` runs of `width` adjacent values. Runs begin
  // `step` values apart and are filtered as wholes, so that memory is read in order.
  const auto filter_lines = [&](std::size_t lines, std::size_t line_stride, int count,
                                std::size_t step, std::size_t width) {
    parallel_for(static_cast<std::int64_t>(lines), [&](std::int64_t l) {
      float* line = values.data() + static_cast<std::size_t>(l) * line_stride;
      std::vector<float> copy(static_cast<std::size_t>(count) * width);
      for (int i = 0; i < count; ++i)
        std::copy_n(line + static_cast<std::size_t>(i) * step, width,
                    copy.data() + static_cast<std::size_t>(i) * width);
      for (int i = 0; i < count; ++i) {
        float* to = line + static_cast<std::size_t>(i) * step;
        std::fill_n(to, width, 0.0f);
        for (int k = -radius; k <= radius; ++k) {
          const float w = weights[static_cast<std::size_t>(k + radius)];
          const float* from =
              copy.data() + static_cast<std::size_t>(std::clamp(i + k, 0, count - 1)) * width;
          for (std::size_t x = 0; x < width; ++x) to[x] += w * from[x];
        }
      }
    });
  };
  const auto row = static_cast<std::size_t>(n.x), layer = row * static_cast<std::size_t>(n.y);
  filter_lines(static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z), row, n.x, /*step=*/1,
               /*width=*/1);
  filter_lines(static_cast<std::size_t>(n.z), layer, n.y, row, row);
  filter_lines(static_cast<std::size_t>(n.y), row, n.z, layer, row);
}

}  // namespace polymorph
