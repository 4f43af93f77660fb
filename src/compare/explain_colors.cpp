#include "compare/explain_colors.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/result.h"
#include "image/srgb.h"

namespace polymorph {
namespace {

constexpr int kBlock = 8;  // pixels; edge of the blocks over which noise is averaged

/// Approximate display lightness (square root of the mean of R, G, B), 0 to 1.
double lightness(const ImagePair& pair, bool of_actual, int pixel) {
  const Vec3 c = pair.color(of_actual, pixel, "");
  return std::sqrt(std::clamp(static_cast<double>(c.x + c.y + c.z) / 3, 0.0, 1.0));
}

/// Gradients of the lightness by central differences, divided by their 99th percentile.
std::vector<double> relative_gradients(const ImagePair& pair, bool of_actual) {
  std::vector<double> lightnesses(static_cast<std::size_t>(pair.pixels())),
      gradients(lightnesses.size());
  for (std::size_t i = 0; i < lightnesses.size(); ++i)
    lightnesses[i] = lightness(pair, of_actual, static_cast<int>(i));
  const auto at = [&](int x, int y) {
    x = std::clamp(x, 0, pair.width() - 1);
    y = std::clamp(y, 0, pair.height() - 1);
    return lightnesses[static_cast<std::size_t>(y * pair.width() + x)];
  };
  for (int y = 0; y < pair.height(); ++y)
    for (int x = 0; x < pair.width(); ++x)
      gradients[static_cast<std::size_t>(y * pair.width() + x)] =
          std::hypot(at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1));
  std::vector<double> sorted = gradients;
  const auto high = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 99 / 100);
  std::nth_element(sorted.begin(), high, sorted.end());
  const double scale = std::max(*high, 1e-6);
  for (double& gradient : gradients) gradient /= scale;
  return gradients;
}

}  // namespace

std::string explain_curve(const ImagePair& pair) {
  // Fit log(new) = slope log(old) + offset by least squares.
  double count = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  std::vector<std::pair<double, double>> points;
  for (int i = 0; i < pair.pixels(); ++i)
    for (const char* c : {"R", "G", "B"}) {
      const double a = static_cast<double>(pair.actual(i, c)),
                   b = static_cast<double>(pair.reference(i, c));
      // Rounding spoils the logarithm of dark colours; bright ones may be clipped.
      if (a < 0.01 || b < 0.01 || a >= 1 || b >= 1) continue;
      const double x = std::log(b), y = std::log(a);
      points.emplace_back(x, y);
      count += 1;
      sx += x;
      sy += y;
      sxx += x * x;
      sxy += x * y;
    }
  // The determinant is count^2 times the variance of x: equal colours do not define a slope.
  const double determinant = count * sxx - sx * sx;
  if (points.size() < 16 || !(determinant > 1e-9 * count * count)) return "";
  const double slope = (count * sxy - sx * sy) / determinant, offset = (sy - slope * sx) / count;
  // Each colour must be within 1 % of the fit, or within 1.5 steps of 8 bits, since a picture may
  // be rounded to 8 bits.
  const auto code = [](double log_value) {
    return 255 * static_cast<double>(linear_to_srgb(static_cast<float>(std::exp(log_value))));
  };
  for (const auto& [x, y] : points) {
    const double expected = slope * x + offset;
    if (std::fabs(expected - y) > 0.01 && std::fabs(code(expected) - code(y)) > 1.5) return "";
  }
  // A slope within 0.003 of 1 is no gamma, a factor within 0.3 % of 1 no brightness.
  if (std::fabs(slope - 1) > 0.003)
    return fmt::format("all colours follow one curve: gamma, the old ones to the power {:.3g}",
                       slope);
  if (std::fabs(offset) > 0.003)
    return fmt::format("all colours are {:.4g} times the old ones: brightness", std::exp(offset));
  return "";
}

bool is_only_rounding(const ImagePair& pair) {
  int changed = 0;
  double sum = 0, magnitude = 0;
  for (int i = 0; i < pair.pixels(); ++i)
    for (const char* c : {"R", "G", "B"}) {
      const auto code = [](float v) {
        return 255 * static_cast<double>(linear_to_srgb(std::clamp(v, 0.0f, 1.0f)));
      };
      const double difference = code(pair.actual(i, c)) - code(pair.reference(i, c));
      // 1.05 allows one step and the rounding of floats. Up to 0.02 steps count as no change.
      if (std::fabs(difference) > 1.05) return false;
      changed += std::fabs(difference) > 0.02;
      sum += difference;
      magnitude += std::fabs(difference);
    }
  // Differences upwards and downwards nearly cancel.
  return changed > 0 && std::fabs(sum) < 0.2 * magnitude;
}

bool is_only_noise(const ImagePair& pair) {
  double squared_sums = 0, expected = 0;
  int counted = 0;
  for (int y = 0; y + kBlock <= pair.height(); y += kBlock)
    for (int x = 0; x + kBlock <= pair.width(); x += kBlock) {
      double sum = 0, squares = 0;
      for (int v = 0; v < kBlock; ++v)
        for (int u = 0; u < kBlock; ++u) {
          const int i = (y + v) * pair.width() + x + u;
          // Compare lightness, so that highlights do not dominate.
          const double d =
              lightness(pair, /*of_actual=*/true, i) - lightness(pair, /*of_actual=*/false, i);
          sum += d;
          squares += d * d;
        }
      if (squares == 0) continue;
      squared_sums += sum * sum;
      expected += squares;
      ++counted;
    }
  // Independent errors give squared_sums close to `expected`. If all pixels of each block change
  // equally, squared_sums is kBlock^2 = 64 times as large.
  return counted > 0 && squared_sums < 4 * expected;
}

bool edges_stay(const ImagePair& pair) {
  // Relative gradients of edges and of areas without an edge; fraction of edge pixels that may
  // vanish.
  constexpr double kStrong = 0.25, kWeak = 0.08, kMaxVanished = 0.03;
  const std::vector<double> a = relative_gradients(pair, /*of_actual=*/true),
                            b = relative_gradients(pair, /*of_actual=*/false);
  for (const auto& [gradients, other_gradients] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    std::size_t strong = 0, vanished = 0;
    for (std::size_t i = 0; i < gradients->size(); ++i) {
      if ((*gradients)[i] < kStrong) continue;
      ++strong;
      vanished += (*other_gradients)[i] < kWeak;
    }
    if (static_cast<double>(vanished) > kMaxVanished * static_cast<double>(strong)) return false;
  }
  return true;
}

std::string explain_region(const ImagePair& pair) {
  int left = pair.width(), top = pair.height(), right = -1, bottom = -1;
  for (int i = 0; i < pair.pixels(); ++i) {
    if (!(length(pair.color(/*of_actual=*/true, i, "") - pair.color(/*of_actual=*/false, i, "")) >
          0))
      continue;
    const int x = i % pair.width(), y = i / pair.width();
    left = std::min(left, x), right = std::max(right, x);
    top = std::min(top, y), bottom = std::max(bottom, y);
  }
  const int width = right - left + 1, height = bottom - top + 1;
  if (width <= 0 || 8.0 * width * height > pair.pixels()) return "";
  return fmt::format("only {} x {} pixels from ({}, {}) on differ", width, height, left, top);
}

}  // namespace polymorph
