// A frame as PNG: the smooth, noisy picture of a preview, 320x240 and 640x480. The counters are
// megapixels a second and the file's bytes a pixel; libpng packs the same picture beside it.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "image/image_io.h"

namespace polymorph {
namespace {

/// A shaded ball over a gradient, with noise of 1 % as few samples leave it.
Image noisy_ball(int width) {
  const int height = width * 3 / 4;
  Image image = make_image(width, height, {"R", "G", "B"});
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 0.01f);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float u = 2.4f * static_cast<float>(x) / static_cast<float>(width) - 1.2f;
      const float v = 1.8f * static_cast<float>(y) / static_cast<float>(height) - 0.9f;
      const float inside = 0.5f - u * u - v * v;
      const float value =
          inside > 0 ? 0.1f + 0.6f * std::sqrt(inside) * (1 - u) : 0.8f - 0.2f * (v + 0.9f);
      for (int c = 0; c < 3; ++c)
        image.at(x, y, c) =
            value * (1 - 0.1f * static_cast<float>(c)) * (1 + (inside > 0 ? noise(random) : 0));
    }
  return image;
}

void encode(benchmark::State& state, PngEffort effort) {
  const Image image = noisy_ball(static_cast<int>(state.range(0)));
  PngSettings settings;
  settings.effort = effort;
  std::size_t bytes = 0;
  for (auto _ : state) {
    auto encoded = encode_png(image, settings);
    if (!encoded) return state.SkipWithError(encoded.error().message.c_str());
    bytes = encoded->size();
  }
  const auto pixels = static_cast<double>(image.width) * image.height;
  state.counters["MP/s"] = benchmark::Counter(
      pixels * 1e-6 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["bytes/pixel"] = static_cast<double>(bytes) / pixels;
}

BENCHMARK_CAPTURE(encode, fast, PngEffort::kFast)
    ->Arg(320)
    ->Arg(640)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(encode, small, PngEffort::kSmall)->Arg(320)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace polymorph

BENCHMARK_MAIN();
