#include "render/film/film.h"

#include <algorithm>
#include <cmath>

#include "render/math/vector_math.h"
#include "scene/scene.h"

namespace polymorph {
namespace {

/// The four-term Blackman-Harris window (Harris 1978) on [-1, 1].
double blackman_harris(double x) {
  const double t = std::numbers::pi * (x + 1);
  return 0.35875 - 0.48829 * exact::cos(t) + 0.14128 * exact::cos(2 * t) -
         0.01168 * exact::cos(3 * t);
}

}  // namespace

PixelFilter make_pixel_filter(float radius) {
  constexpr int kSteps = 4096;  // steps of the numerical integration of the window
  std::vector<double> cdf(kSteps + 1, 0.0);
  for (int i = 0; i < kSteps; ++i)
    cdf[i + 1] = cdf[i] + blackman_harris((i + 0.5) / kSteps * 2 - 1);
  // Invert the CDF at equally spaced values.
  PixelFilter filter;
  int step = 0;
  for (int i = 0; i <= PixelFilter::kCells; ++i) {
    const double target = cdf.back() * i / PixelFilter::kCells;
    while (step < kSteps - 1 && cdf[step + 1] < target) ++step;
    const double fraction = (target - cdf[step]) / (cdf[step + 1] - cdf[step]);
    filter.offsets[i] =
        radius * static_cast<float>((step + std::clamp(fraction, 0.0, 1.0)) / kSteps * 2 - 1);
  }
  // Make the table symmetric, so that rounding does not shift the image.
  for (int i = 0; i <= PixelFilter::kCells / 2; ++i) {
    const float half = 0.5f * (filter.offsets[PixelFilter::kCells - i] - filter.offsets[i]);
    filter.offsets[i] = -half;
    filter.offsets[PixelFilter::kCells - i] = half;
  }
  return filter;
}

std::vector<const Aov*> choose_aovs(const std::string& layers) {
  std::vector<const Aov*> chosen;
  for (const Aov& aov : kAovs)
    if (includes_aov(layers, aov.layer)) chosen.push_back(&aov);
  return chosen;
}

std::vector<std::string> list_film_channels(const std::vector<const Aov*>& aovs) {
  std::vector<std::string> channels{"R", "G", "B", "A"};
  for (const Aov* aov : aovs) channels.emplace_back(aov->channel);
  return channels;
}

}  // namespace polymorph
