#include "compare/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "base/result.h"
#include "image/rgb_channels.h"

namespace polymorph {
namespace {

using Color = std::array<float, 3>;
using Plane = std::vector<float>;

constexpr std::int64_t kRowsPerTask = 8;

// Matrix from linear Rec. 709 to XYZ (D65), divided by the XYZ of white, and its inverse.
constexpr float kToXyz[3][3] = {{0.433895389f, 0.376242373f, 0.189862239f},
                                {0.212636822f, 0.715182982f, 0.072180196f},
                                {0.017752423f, 0.109465629f, 0.872781948f}};
constexpr float kFromXyz[3][3] = {{3.080341988f, -1.537398969f, -0.542943019f},
                                  {-0.921178396f, 1.875929984f, 0.045248412f},
                                  {0.052881293f, -0.204011206f, 1.151129913f}};

Color multiply(const float (&m)[3][3], const Color& v) {
  Color result;
  for (std::size_t i = 0; i < 3; ++i) result[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return result;
}

/// Converts to opponent colours (lightness, red-green, blue-yellow) that are linear in the colour,
/// for blurring.
Color to_opponent(const Color& rgb) {
  const Color xyz = multiply(kToXyz, rgb);
  return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])};
}

Color from_opponent(const Color& opponent) {
  const float y = (opponent[0] + 16) / 116;
  return multiply(kFromXyz, {y + opponent[1] / 500, y, y - opponent[2] / 200});
}

/// Converts to CIE L*a*b* with a and b scaled by L / 100, because an equal step in colour is less
/// visible in the dark (Hunt effect).
Color to_hunt_lab(const Color& rgb) {
  constexpr float kDelta = 6.0f / 29;
  Color xyz = multiply(kToXyz, rgb);
  for (float& t : xyz)
    t = t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0f / 29;
  const float lightness = 116 * xyz[1] - 16;
  return {lightness, 0.01f * lightness * 500 * (xyz[0] - xyz[1]),
          0.01f * lightness * 200 * (xyz[1] - xyz[2])};
}

/// HyAB distance of two colours: |difference of L| + Euclidean distance of (a, b).
float hyab(const Color& a, const Color& b) {
  return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

/// Weights of pixels -radius .. radius. All filters here are separable, or sums of separable ones.
struct Kernel {
  int radius = 0;
  std::vector<float> weights;
};

/// Makes the kernel with the weights f(-radius) .. f(radius).
template <class F>
Kernel sample(int radius, const F& f) {
  Kernel kernel{radius, /*weights=*/{}};
  for (int i = -radius; i <= radius; ++i)
    kernel.weights.push_back(static_cast<float>(f(static_cast<double>(i))));
  return kernel;
}

/// Makes the kernel exp(-rate x^2) / sum, where `sum` is set to the sum of exp(-rate x^2).
Kernel gaussian(int radius, double rate, double& sum) {
  sum = 0;
  for (int i = -radius; i <= radius; ++i) sum += std::exp(-rate * i * i);
  return sample(radius, [&](double x) { return std::exp(-rate * x * x) / sum; });
}

/// Scales the positive weights to the sum 1, the negative ones to -1.
Kernel balance(Kernel kernel) {
  double above = 0, below = 0;
  for (const float w : kernel.weights) (w > 0 ? above : below) += static_cast<double>(w);
  for (float& w : kernel.weights) w /= static_cast<float>(w > 0 ? above : -below);
  return kernel;
}

/// All filters of FLIP.
struct Filters {
  Kernel sharp[2];     ///< one Gaussian each for lightness and red-green
  Kernel blue[2];      ///< two Gaussians for blue-yellow
  float weight[2];     ///< weights of the Gaussians in `blue`; their sum is 1
  Kernel smooth;       ///< Gaussian of the feature detectors
  Kernel edge, point;  ///< first and second derivative of `smooth`
};

/// Makes the filters for a screen of this resolution.
Filters make_filters(double pixels_per_degree) {
  constexpr double kPi = std::numbers::pi;
  // The contrast sensitivity functions as Gaussians sqrt(pi / b) a exp(-pi^2 x^2 / b) of the
  // distance x in degrees. The constants are those of the paper: b for lightness and red-green, a
  // and b for blue-yellow.
  constexpr double kLight = 0.0047, kRedGreen = 0.0053, kBlueA[2] = {34.1, 13.5},
                   kBlueB[2] = {0.04, 0.025};
  // Three standard deviations sqrt(b / (2 pi^2)) of the widest Gaussian, b = 0.04.
  const auto radius =
      static_cast<int>(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * pixels_per_degree));
  const auto rate = [&](double b) {
    return kPi * kPi / b / (pixels_per_degree * pixels_per_degree);
  };
  Filters filters;
  double sum = 0, total = 0, integrals[2];
  filters.sharp[0] = gaussian(radius, rate(kLight), sum);
  filters.sharp[1] = gaussian(radius, rate(kRedGreen), sum);
  for (int k = 0; k < 2; ++k) {
    filters.blue[k] = gaussian(radius, rate(kBlueB[k]), sum);
    // The sum of the Gaussian over a square of pixels is sum^2, since it is separable.
    integrals[k] = kBlueA[k] * std::sqrt(kPi / kBlueB[k]) * sum * sum;
    total += integrals[k];
  }
  for (int k = 0; k < 2; ++k) filters.weight[k] = static_cast<float>(integrals[k] / total);
  // Features are as wide as the finest edges that are easily seen: 0.082 degrees.
  const double sigma = 0.5 * 0.082 * pixels_per_degree, feature_rate = 1 / (2 * sigma * sigma);
  const auto feature_radius = static_cast<int>(std::ceil(3 * sigma));
  filters.smooth = gaussian(feature_radius, feature_rate, sum);
  filters.edge = balance(
      sample(feature_radius, [&](double x) { return -x * std::exp(-feature_rate * x * x); }));
  filters.point = balance(sample(feature_radius, [&](double x) {
    return (x * x / (sigma * sigma) - 1) * std::exp(-feature_rate * x * x);
  }));
  return filters;
}

/// Size of a picture in pixels.
struct Size {
  int width, height;
  /// Returns the index of the first pixel in row y.
  std::size_t row(std::int64_t y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
  std::size_t pixels() const { return row(height); }
};

/// Filters each row. Beyond the picture, the row's first and last pixels are repeated.
Plane filter_rows(const Plane& in, Size size, const Kernel& kernel) {
  Plane out(in.size());
  parallel_ranges(size.height, kRowsPerTask, [&](std::int64_t begin, std::int64_t end) {
    const int r = kernel.radius;
    std::vector<float> line(static_cast<std::size_t>(size.width + 2 * r));
    for (std::int64_t y = begin; y < end; ++y) {
      const float* row = &in[size.row(y)];
      for (int x = -r; x < size.width + r; ++x)
        line[static_cast<std::size_t>(x + r)] = row[std::clamp(x, 0, size.width - 1)];
      float* result = &out[size.row(y)];
      for (std::size_t k = 0; k < kernel.weights.size(); ++k)
        for (int x = 0; x < size.width; ++x)
          result[x] += kernel.weights[k] * line[static_cast<std::size_t>(x) + k];
    }
  });
  return out;
}

Plane filter_columns(const Plane& in, Size size, const Kernel& kernel) {
  Plane out(in.size());
  parallel_for(
      size.height,
      [&](std::int64_t y) {
        float* result = &out[size.row(y)];
        for (std::size_t k = 0; k < kernel.weights.size(); ++k) {
          const std::int64_t source = y + static_cast<std::int64_t>(k) - kernel.radius;
          const float* row = &in[size.row(std::clamp<std::int64_t>(source, 0, size.height - 1))];
          for (int x = 0; x < size.width; ++x) result[x] += kernel.weights[k] * row[x];
        }
      },
      kRowsPerTask);
  return out;
}

Plane filter(const Plane& in, Size size, const Kernel& rows, const Kernel& columns) {
  return filter_columns(filter_rows(in, size, rows), size, columns);
}

/// A picture as a viewer perceives it: blurred colours, and the strength of edges and points.
struct Perceived {
  std::vector<Color> lab;
  Plane edges, points;
};

/// An image in opponent colours.
struct Picture {
  Plane opponent[3];
  std::vector<bool> not_finite;  ///< per pixel
};

Picture read_picture(const Image& image, Size size, float exposure) {
  PM_CHECK(has_rgb(image));
  const std::array<int, 3> channels = find_rgb(image);
  const float gain = std::exp2(exposure);
  Picture picture;
  for (Plane& plane : picture.opponent) plane.resize(size.pixels());
  picture.not_finite.resize(size.pixels());
  for (std::size_t i = 0; i < size.pixels(); ++i) {
    Color rgb;
    for (std::size_t c = 0; c < 3; ++c) {
      const float value =
          image.pixels[i * image.channel_count() + static_cast<std::size_t>(channels[c])];
      if (!std::isfinite(value)) picture.not_finite[i] = true;
      rgb[c] = value > 0 && std::isfinite(value) ? std::min(gain * value, 1.0f) : 0.0f;
    }
    const Color opponent = to_opponent(rgb);
    for (std::size_t c = 0; c < 3; ++c) picture.opponent[c][i] = opponent[c];
  }
  return picture;
}

/// Computes sqrt(x^2 + y^2) per pixel.
Plane gradient_length(const Plane& x, const Plane& y) {
  Plane lengths(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) lengths[i] = std::sqrt(x[i] * x[i] + y[i] * y[i]);
  return lengths;
}

Perceived perceive(const Picture& picture, Size size, const Filters& filters) {
  // Blur the colours by the contrast sensitivity functions; blue-yellow has two Gaussians.
  Plane blurred[3];
  for (int c = 0; c < 2; ++c)
    blurred[c] = filter(picture.opponent[c], size, filters.sharp[c], filters.sharp[c]);
  blurred[2] = filter(picture.opponent[2], size, filters.blue[0], filters.blue[0]);
  const Plane wide = filter(picture.opponent[2], size, filters.blue[1], filters.blue[1]);
  Perceived perceived;
  perceived.lab.resize(size.pixels());
  parallel_ranges(
      static_cast<std::int64_t>(size.pixels()), /*grain=*/4096,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
          Color rgb =
              from_opponent({blurred[0][i], blurred[1][i],
                             filters.weight[0] * blurred[2][i] + filters.weight[1] * wide[i]});
          for (float& value : rgb) value = std::clamp(value, 0.0f, 1.0f);
          perceived.lab[i] = to_hunt_lab(rgb);
        }
      });
  // Find edges and points in the unblurred luminance, 0 to 1 (see to_opponent()).
  Plane luminance = picture.opponent[0];
  for (float& value : luminance) value = (value + 16) / 116;
  perceived.edges = gradient_length(filter(luminance, size, filters.edge, filters.smooth),
                                    filter(luminance, size, filters.smooth, filters.edge));
  perceived.points = gradient_length(filter(luminance, size, filters.point, filters.smooth),
                                     filter(luminance, size, filters.smooth, filters.point));
  return perceived;
}

/// Maps the difference hyab()^0.7 of two colours to 0 .. 1. `largest` is that of pure green and
/// pure blue. Differences below 0.4 of `largest` are mapped to 0 .. 0.95. The constants are the
/// paper's.
float color_difference(const Color& a, const Color& b, float largest) {
  constexpr float kPower = 0.7f, kSplit = 0.4f, kSplitValue = 0.95f;
  const float value = std::pow(hyab(a, b), kPower), split = kSplit * largest;
  if (value < split) return kSplitValue * value / split;
  return std::min(1.0f, kSplitValue + (value - split) / (largest - split) * (1 - kSplitValue));
}

}  // namespace

std::vector<float> flip_map(const Image& actual, const Image& reference,
                            const FlipSettings& settings) {
  PM_CHECK(actual.width == reference.width && actual.height == reference.height);
  PM_CHECK(settings.pixels_per_degree > 0);
  const Size size{reference.width, reference.height};
  if (size.pixels() == 0) return {};
  const Filters filters = make_filters(static_cast<double>(settings.pixels_per_degree));
  const Picture pictures[] = {read_picture(actual, size, settings.exposure),
                              read_picture(reference, size, settings.exposure)};
  const Perceived a = perceive(pictures[0], size, filters),
                  b = perceive(pictures[1], size, filters);
  // 0.7 is kPower of color_difference().
  const float largest = std::pow(hyab(to_hunt_lab({0, 1, 0}), to_hunt_lab({0, 0, 1})), 0.7f);
  std::vector<float> map(size.pixels());
  parallel_ranges(
      static_cast<std::int64_t>(map.size()), /*grain=*/4096,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
          // FLIP = (colour difference)^(1 - feature difference), both 0 to 1.
          const float change =
              std::max(std::abs(a.edges[i] - b.edges[i]), std::abs(a.points[i] - b.points[i]));
          const float feature = std::min(1.0f, std::sqrt(change / std::numbers::sqrt2_v<float>));
          map[i] = std::pow(color_difference(a.lab[i], b.lab[i], largest), 1 - feature);
          if (pictures[0].not_finite[i] || pictures[1].not_finite[i]) map[i] = 1;
        }
      });
  return map;
}

FlipStatistics flip_statistics(const std::vector<float>& map) {
  if (map.empty()) return {};
  std::vector<float> sorted = map;
  std::sort(sorted.begin(), sorted.end());
  const auto quantile = [&](double fraction) {
    const double rank = std::ceil(fraction * static_cast<double>(sorted.size()));
    return static_cast<double>(sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1]);
  };
  double sum = 0;
  for (const float value : map) sum += static_cast<double>(value);
  return {sum / static_cast<double>(map.size()), quantile(0.5), quantile(0.99), quantile(1)};
}

}  // namespace polymorph
