#include "image/palette.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/result.h"

namespace polymorph {
namespace {

constexpr std::size_t kCells = std::size_t{64} * 64 * 64;  // 4 of 256 codes per side of a cell

/// Index of a colour's cell: (64 r + g) 64 + b with the upper 6 bits of each code.
std::size_t find_cell(Rgb8 c) {
  return static_cast<std::size_t>(c[0] >> 2) << 12 | static_cast<std::size_t>(c[1] >> 2) << 6 |
         static_cast<std::size_t>(c[2] >> 2);
}

using Color = std::array<double, 3>;

/// The colours of a cell of the histogram.
struct Sample {
  Color color;  ///< mean
  double weight;
};

/// A range of samples that get a common palette entry.
struct ColorBox {
  std::size_t begin, end;
  double error = 0;      ///< sum of the weighted squared distances from the mean
  std::size_t axis = 0;  ///< the channel with the largest part of the error
  double mean = 0;       ///< mean of this channel
};

/// Computes the members of the box of the samples [begin, end).
ColorBox measure_box(const std::vector<Sample>& samples, std::size_t begin, std::size_t end) {
  ColorBox box{begin, end};
  double max_axis_error = -1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double weight = 0, sum = 0, squares = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const double value = samples[i].color[axis];
      weight += samples[i].weight;
      sum += samples[i].weight * value;
      squares += samples[i].weight * value * value;
    }
    // The weighted squared distances from the mean, in this channel.
    const double axis_error = std::max(0.0, squares - sum * sum / weight);
    box.error += axis_error;
    if (axis_error <= max_axis_error) continue;
    max_axis_error = axis_error;
    box.axis = axis;
    box.mean = sum / weight;
  }
  return box;
}

double squared_distance(const Color& a, const Color& b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return x * x + y * y + z * z;
}

Color compute_mean(const std::vector<Sample>& samples, const ColorBox& box) {
  Color sum{};
  double weight = 0;
  for (std::size_t i = box.begin; i < box.end; ++i) {
    weight += samples[i].weight;
    for (std::size_t axis = 0; axis < 3; ++axis)
      sum[axis] += samples[i].weight * samples[i].color[axis];
  }
  for (double& s : sum) s /= weight;
  return sum;
}

/// Divides the box with the largest error at its mean until there are `size` boxes. Returns the
/// mean colours of the boxes.
std::vector<Color> median_cut(std::vector<Sample>& samples, std::size_t size) {
  std::vector<ColorBox> boxes;
  if (!samples.empty()) boxes.push_back(measure_box(samples, 0, samples.size()));
  while (!boxes.empty() && boxes.size() < size) {
    const auto worst =
        std::max_element(boxes.begin(), boxes.end(),
                         [](const ColorBox& a, const ColorBox& b) { return a.error < b.error; });
    if (worst->end - worst->begin < 2 || worst->error <= 0) break;
    const ColorBox box = *worst;
    const auto begin = samples.begin();
    const auto cut =
        std::stable_partition(begin + static_cast<std::ptrdiff_t>(box.begin),
                              begin + static_cast<std::ptrdiff_t>(box.end),
                              [&](const Sample& s) { return s.color[box.axis] <= box.mean; });
    // Rounding of the mean may leave one side empty.
    const auto middle = static_cast<std::size_t>(cut - begin);
    if (middle == box.begin || middle == box.end) break;
    *worst = measure_box(samples, box.begin, middle);
    boxes.push_back(measure_box(samples, middle, box.end));
  }
  std::vector<Color> colors;
  for (const ColorBox& box : boxes) colors.push_back(compute_mean(samples, box));
  return colors;
}

/// Refines the colours by four rounds of Lloyd's iteration.
void refine(const std::vector<Sample>& samples, std::vector<Color>& colors) {
  std::vector<std::size_t> owner(samples.size());  // index of the nearest colour per sample
  for (int round = 0; round < 4; ++round) {
    parallel_for(
        static_cast<std::int64_t>(samples.size()),
        [&](std::int64_t n) {
          const auto i = static_cast<std::size_t>(n);
          std::size_t best = 0;
          for (std::size_t k = 1; k < colors.size(); ++k)
            if (squared_distance(samples[i].color, colors[k]) <
                squared_distance(samples[i].color, colors[best]))
              best = k;
          owner[i] = best;
        },
        /*grain=*/256);
    std::vector<Color> sums(colors.size());
    std::vector<double> weights(colors.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      weights[owner[i]] += samples[i].weight;
      for (std::size_t axis = 0; axis < 3; ++axis)
        sums[owner[i]][axis] += samples[i].weight * samples[i].color[axis];
    }
    for (std::size_t k = 0; k < colors.size(); ++k)
      for (std::size_t axis = 0; axis < 3 && weights[k] > 0; ++axis)
        colors[k][axis] = sums[k][axis] / weights[k];
  }
}

int squared_distance(std::array<int, 3> a, Rgb8 b) {
  const int x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return x * x + y * y + z * z;
}

}  // namespace

ColorHistogram::ColorHistogram() : cells_(kCells) {}

void ColorHistogram::add(const std::vector<Rgb8>& pixels) {
  for (const Rgb8& pixel : pixels) {
    Cell& cell = cells_[find_cell(pixel)];
    ++cell.count;
    for (std::size_t axis = 0; axis < 3; ++axis) cell.sum[axis] += pixel[axis];
  }
}

std::vector<Rgb8> choose_palette(const ColorHistogram& histogram, std::size_t size) {
  std::vector<Sample> samples;
  for (const auto& cell : histogram.cells_) {
    if (cell.count == 0) continue;
    const auto count = static_cast<double>(cell.count);
    samples.push_back(
        {{static_cast<double>(cell.sum[0]) / count, static_cast<double>(cell.sum[1]) / count,
          static_cast<double>(cell.sum[2]) / count},
         std::sqrt(count)});
  }
  std::vector<Color> colors = median_cut(samples, size);
  refine(samples, colors);
  std::vector<Rgb8> palette;
  for (const Color& color : colors)
    palette.push_back({static_cast<std::uint8_t>(std::lround(color[0])),
                       static_cast<std::uint8_t>(std::lround(color[1])),
                       static_cast<std::uint8_t>(std::lround(color[2]))});
  std::sort(palette.begin(), palette.end());
  palette.erase(std::unique(palette.begin(), palette.end()), palette.end());
  return palette;
}

PaletteMap::PaletteMap(const std::vector<Rgb8>& palette) : palette_(palette), table_(kCells) {
  PM_CHECK(!palette.empty() && palette.size() <= 256);
  parallel_for(
      64 * 64,
      [&](std::int64_t row) {  // the cells of one red and one green: row = 64 r + g
        for (int b = 0; b < 64; ++b) {
          const std::array<int, 3> middle{static_cast<int>(row >> 6) * 4 + 2,
                                          static_cast<int>(row & 63) * 4 + 2, b * 4 + 2};
          std::size_t best = 0;
          for (std::size_t k = 1; k < palette_.size(); ++k)
            if (squared_distance(middle, palette_[k]) < squared_distance(middle, palette_[best]))
              best = k;
          table_[static_cast<std::size_t>(row) * 64 + static_cast<std::size_t>(b)] =
              static_cast<std::uint8_t>(best);
        }
      },
      /*grain=*/64);
}

std::uint8_t PaletteMap::nearest(std::array<int, 3> color) const {
  Rgb8 clamped{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    clamped[axis] = static_cast<std::uint8_t>(std::clamp(color[axis], 0, 255));
  return table_[find_cell(clamped)];
}

std::uint8_t PaletteMap::dither(Rgb8 color, float threshold) const {
  const std::uint8_t first = nearest({color[0], color[1], color[2]});
  const Rgb8 first_color = palette_[first];
  // The second entry is that nearest to the reflection of the first about the pixel's colour.
  const std::uint8_t second = nearest({2 * color[0] - first_color[0], 2 * color[1] - first_color[1],
                                       2 * color[2] - first_color[2]});
  if (first == second) return first;
  const Rgb8 second_color = palette_[second];
  // projection / length2 is 0 at the first entry and 1 at the second.
  int projection = 0, length2 = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    projection += (color[axis] - first_color[axis]) * (second_color[axis] - first_color[axis]);
    length2 += (second_color[axis] - first_color[axis]) * (second_color[axis] - first_color[axis]);
  }
  return static_cast<float>(projection) > threshold * static_cast<float>(length2) ? second : first;
}

}  // namespace polymorph
