#include <algorithm>
#include <vector>

#include "base/parallel.h"
#include "image/strip.h"

namespace polymorph {
namespace {

/// Source samples that one target sample covers, and their weights.
struct Span {
  std::size_t first;
  std::vector<float> weights;  ///< sum 1
};

/// Computes the weights of a box filter for each target sample.
std::vector<Span> make_box_filter(int source_size, int target_size) {
  std::vector<Span> spans;
  const double scale = static_cast<double>(source_size) / target_size;
  for (int i = 0; i < target_size; ++i) {
    const double begin = i * scale, end = std::min<double>((i + 1) * scale, source_size);
    const int first = std::min(static_cast<int>(begin), source_size - 1);
    Span span{static_cast<std::size_t>(first), /*weights=*/{}};
    for (int s = first; s < source_size && s < end; ++s) {
      const double overlap = std::min<double>(end, s + 1) - std::max<double>(begin, s);
      // Rounding may give a tiny overlap to a sample beyond the end. It is left out.
      if (overlap > 1e-9 * scale || span.weights.empty())
        span.weights.push_back(static_cast<float>(overlap / scale));
    }
    spans.push_back(std::move(span));
  }
  return spans;
}

}  // namespace

Image resize_image(const Image& image, int width, int height) {
  PM_CHECK(width > 0 && height > 0 && image.width > 0 && image.height > 0);
  if (width == image.width && height == image.height) return image;
  const std::size_t count = image.channel_count();
  const std::size_t from_width = static_cast<std::size_t>(image.width),
                    to_width = static_cast<std::size_t>(width);
  const std::vector<Span> columns = make_box_filter(image.width, width),
                          rows = make_box_filter(image.height, height);
  Image result = make_image(width, height, image.channels);
  result.attributes = image.attributes;
  parallel_for(
      height,
      [&](std::int64_t y) {
        const Span& row = rows[static_cast<std::size_t>(y)];
        std::vector<float> line(from_width * count);  // source columns, rows averaged
        for (std::size_t r = 0; r < row.weights.size(); ++r) {
          const float* source = &image.pixels[(row.first + r) * from_width * count];
          for (std::size_t i = 0; i < line.size(); ++i) line[i] += row.weights[r] * source[i];
        }
        for (std::size_t x = 0; x < to_width; ++x) {
          float* out = &result.pixels[(static_cast<std::size_t>(y) * to_width + x) * count];
          for (std::size_t k = 0; k < columns[x].weights.size(); ++k)
            for (std::size_t c = 0; c < count; ++c)
              out[c] += columns[x].weights[k] * line[(columns[x].first + k) * count + c];
        }
      },
      /*grain=*/8);
  return result;
}

}  // namespace polymorph
