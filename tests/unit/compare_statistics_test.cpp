#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/random.h"
#include "compare/statistics.h"

namespace polymorph {
namespace {

constexpr int kRuns = 16;

/// A rendering: a ramp, each pixel the mean of `samples` values that are now and then bright.
Image rendering(std::uint64_t seed, int samples, float bias = 0, int bias_from = 0) {
  Image image = make_image(64, 48, {"R", "G", "B"});
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const auto x = static_cast<int>(i / 3 % 64);
    const float level = 0.1f + 0.01f * static_cast<float>(x);
    float sum = 0;
    for (int s = 0; s < samples; ++s)
      sum += random_float(seed, i, static_cast<std::uint64_t>(s)) < 0.3f ? level / 0.3f : 0;
    image.pixels[i] = sum / static_cast<float>(samples) + (x >= bias_from ? bias : 0);
  }
  return image;
}

std::vector<Image> renderings(std::uint64_t first, int samples, float bias = 0, int from = 0) {
  std::vector<Image> runs;
  for (std::uint64_t run = 0; run < kRuns; ++run)
    runs.push_back(rendering(first + run, samples, bias, from));
  return runs;
}

TEST(Statistics, NoiseAlonePasses) {
  const auto runs = renderings(100, 16);
  int failed = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed)
    failed += !compare_statistics(runs, 16, rendering(1000 + seed, 16), 16)->passed;
  EXPECT_EQ(failed, 0) << "of 50";
}

TEST(Statistics, MoreOrFewerSamplesPass) {
  const Image reference = rendering(1, 16);
  for (const int samples : {4, 64}) {
    const auto result = compare_statistics(renderings(100, samples), samples, reference, 16);
    EXPECT_TRUE(result->passed) << samples << ": " << result->reason;
  }
  // Were the reference taken for one of many samples, its noise would be too strong.
  EXPECT_FALSE(compare_statistics(renderings(100, 64), 64, reference, 4096)->passed);
}

TEST(Statistics, ABiasFarBelowThePixelsNoiseFails) {
  // One pixel's standard deviation is about 0.1 to 0.25.
  const auto result = compare_statistics(renderings(100, 16, 0.06f), 16, rendering(1, 16), 16);
  EXPECT_FALSE(result->passed) << result->reason;
  EXPECT_GT(result->failing_tiles, 5);
  const auto here = compare_statistics(renderings(100, 16, 0.15f, 48), 16, rendering(1, 16), 16);
  EXPECT_FALSE(here->passed);
  EXPECT_GE(here->worst_x, 48);
}

TEST(Statistics, WhatHasNoNoiseMayDifferByRounding) {
  Image flat = make_image(16, 16, {"R", "G", "B"});
  for (float& v : flat.pixels) v = 0.5f;
  const std::vector<Image> runs(kRuns, flat);
  Image rounded = flat;
  for (float& v : rounded.pixels) v += 2e-4f;
  EXPECT_TRUE(compare_statistics(runs, 16, rounded, 16)->passed);
  for (float& v : rounded.pixels) v += 0.02f;
  EXPECT_FALSE(compare_statistics(runs, 16, rounded, 16)->passed);
}

TEST(Statistics, NotFiniteFailsAndSizesMustAgree) {
  auto runs = renderings(100, 4);
  const Image reference = rendering(1, 4);
  runs[3].pixels[7] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(compare_statistics(runs, 4, reference, 4)->passed);
  runs[3] = make_image(4, 4, {"R", "G", "B"});
  EXPECT_FALSE(compare_statistics(runs, 4, reference, 4));
}

}  // namespace
}  // namespace polymorph
