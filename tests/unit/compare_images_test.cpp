#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/random.h"
#include "compare/compare.h"

namespace polymorph {
namespace {

/// A ball (id 2) on a ground (id 1) under an empty sky (id 0), with all that the renderer writes.
Image render_ball() {
  Image image = make_image(96, 72, {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "id"});
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float dx = (static_cast<float>(x) - 47.5f) / 22, dy = (static_cast<float>(y) - 36) / 22;
      const float d = dx * dx + dy * dy;
      float* p = &image.at(x, y, 0);
      const float sky = 0.2f + 0.004f * static_cast<float>(y);
      const float values[] = {sky, sky * 1.1f, sky * 1.3f, 1, 1e10f, 0, 0, 0, 0};
      std::copy(std::begin(values), std::end(values), p);
      if (d < 1) {
        const float nz = std::sqrt(1 - d);
        const float ball[] = {0.9f * nz, 0.5f * nz, 0.1f + 0.1f * nz, 1, 5 - nz, dx, -dy, nz, 2};
        std::copy(std::begin(ball), std::end(ball), p);
      } else if (y > 50) {
        const float ground[] = {0.3f, 0.3f, 0.31f, 1, 400.0f / static_cast<float>(y), 0, 1, 0, 1};
        std::copy(std::begin(ground), std::end(ground), p);
      }
    }
  return image;
}

/// The colours only, without the masks and planes that catch errors of geometry.
Image colors_of(const Image& image) {
  Image colors = make_image(image.width, image.height, {"R", "G", "B"});
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) colors.at(x, y, c) = image.at(x, y, c);
  return colors;
}

Image with_noise(Image image, float amplitude) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c)
        image.at(x, y, c) +=
            amplitude * (2 * random_float(1, static_cast<std::uint64_t>(c),
                                          static_cast<std::uint64_t>(y * image.width + x)) -
                         1);
  return image;
}

Image shifted(const Image& image) {
  Image moved = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 1; x < image.width; ++x)
      for (int c = 0; c < static_cast<int>(image.channel_count()); ++c)
        moved.at(x, y, c) = image.at(x - 1, y, c);
  return moved;
}

const Tolerance kStrict{.hard_fail = 0.1f, .why = "test"};

// The comparator's own test: known damage, known verdicts.

TEST(CompareImages, EqualImagesAreTheSame) {
  const Image image = render_ball();
  const Comparison result = compare_images(image, image, {});
  EXPECT_EQ(result.verdict, Verdict::kSame);
  EXPECT_TRUE(result.passed());
  EXPECT_TRUE(std::isinf(result.psnr));
  EXPECT_EQ(result.failing_pixels, 0u);
  EXPECT_EQ(result.pixels, 96u * 72u);
}

TEST(CompareImages, OneLsbOfNoiseIsWithin) {
  const Image image = render_ball();
  const Comparison result = compare_images(with_noise(image, 1 / 255.0f * 0.99f), image, {});
  EXPECT_EQ(result.verdict, Verdict::kWithin) << result.reason;
  EXPECT_GT(result.psnr, 48);
}

TEST(CompareImages, TenLsbOfNoiseDiffer) {
  const Image image = render_ball();
  EXPECT_EQ(compare_images(with_noise(image, 10 / 255.0f), image, {}).verdict, Verdict::kDiffers);
}

TEST(CompareImages, ABlackFrameDiffers) {
  const Image image = colors_of(render_ball());
  const Comparison result = compare_images(make_image(96, 72, {"R", "G", "B"}), image, {});
  EXPECT_EQ(result.verdict, Verdict::kDiffers);
  EXPECT_EQ(result.failing_pixels, result.pixels);
  EXPECT_LT(result.psnr, 15);
}

TEST(CompareImages, AShiftByOnePixelDiffers) {
  const Image image = render_ball();
  EXPECT_EQ(compare_images(shifted(image), image, {}).verdict, Verdict::kDiffers);
  EXPECT_EQ(compare_images(shifted(colors_of(image)), colors_of(image), {}).verdict,
            Verdict::kDiffers);
}

TEST(CompareImages, AFireflyIsCaughtByTheHardLimitAlone) {
  const Image image = render_ball();
  Image spark = image;
  spark.at(47, 36, 1) += 0.5f;
  const Comparison lax = compare_images(spark, image, {});
  EXPECT_EQ(lax.verdict, Verdict::kWithin) << "one pixel of 6912 is below 0.1 %";
  const Comparison strict = compare_images(spark, image, kStrict);
  EXPECT_EQ(strict.verdict, Verdict::kDiffers);
  EXPECT_EQ(strict.hard_failing_pixels, 1u);
  EXPECT_NE(strict.reason.find("G at (47, 36)"), std::string::npos) << strict.reason;
}

TEST(CompareImages, SilhouettesAreSparedByTheHardLimitOnlyWithIds) {
  const Image image = render_ball();
  int edge = 0;
  while (image.at(edge, 36, 8) != 2) ++edge;
  Image other = image;
  other.at(edge, 36, 0) += 0.5f;
  EXPECT_EQ(compare_images(other, image, kStrict).verdict, Verdict::kWithin);
  EXPECT_EQ(compare_images(colors_of(other), colors_of(image), kStrict).verdict, Verdict::kDiffers);
}

TEST(CompareImages, NotFiniteAlwaysFails) {
  const Image image = render_ball();
  Tolerance all;
  all.fail = all.relative = all.fail_percent = 1e30f;
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity()})
    for (const int channel : {0, 3, 4, 6, 8}) {
      Image other = image;
      other.at(5, 6, channel) = bad;
      EXPECT_EQ(compare_images(other, image, all).verdict, Verdict::kNotFinite);
      EXPECT_EQ(compare_images(image, other, all).verdict, Verdict::kNotFinite);
      const Comparison both = compare_images(other, other, all);
      EXPECT_EQ(both.verdict, Verdict::kNotFinite) << "even when both have it";
      EXPECT_EQ(both.not_finite_pixels, 1u);
    }
}

TEST(CompareImages, SwappedChannelsDiffer) {
  const Image image = colors_of(render_ball());
  Image swapped = image;
  for (std::size_t i = 0; i < swapped.pixels.size(); i += 3)
    std::swap(swapped.pixels[i], swapped.pixels[i + 2]);
  EXPECT_EQ(compare_images(swapped, image, {}).verdict, Verdict::kDiffers);
}

TEST(CompareImages, AWrongCurveDiffers) {
  const Image image = colors_of(render_ball());
  Image encoded = image;
  for (float& value : encoded.pixels) value = std::pow(value, 1 / 2.2f);
  EXPECT_EQ(compare_images(encoded, image, {}).verdict, Verdict::kDiffers);
  Image slightly = image;
  for (float& value : slightly.pixels) value = std::pow(value, 1.05f);
  EXPECT_EQ(compare_images(slightly, image, {}).verdict, Verdict::kDiffers);
}

TEST(CompareImages, SizeAndChannelsAreToldApart) {
  const Image image = colors_of(render_ball());
  const Comparison size = compare_images(make_image(72, 96, {"R", "G", "B"}), image, {});
  EXPECT_EQ(size.verdict, Verdict::kSizeMismatch);
  EXPECT_EQ(size.reason, "sizes differ: 72 x 96 instead of 96 x 72");
  const Comparison channels = compare_images(make_image(96, 72, {"R", "G", "Y"}), image, {});
  EXPECT_EQ(channels.verdict, Verdict::kChannelMismatch);
  EXPECT_EQ(channels.reason, "channels differ: missing B; extra Y");
}

TEST(CompareImages, TheOrderOfChannelsDoesNotMatter) {
  Image a = make_image(1, 1, {"R", "G", "B"}), b = make_image(1, 1, {"B", "R", "G"});
  a.pixels = {1, 2, 3};
  b.pixels = {3, 1, 2};
  EXPECT_EQ(compare_images(a, b, {}).verdict, Verdict::kSame);
}

TEST(CompareImages, DepthIsRelativeAndKnowsNothingHit) {
  Image a = make_image(10, 10, {"Z"});
  for (float& z : a.pixels) z = 100;
  Image b = a;
  b.at(3, 3, 0) = 100.09f;
  EXPECT_EQ(compare_images(b, a, {.fail_percent = 0}).failing_pixels, 0u);
  b.at(3, 3, 0) = 100.2f;
  EXPECT_EQ(compare_images(b, a, {.fail_percent = 0}).failing_pixels, 1u);
  a.at(3, 3, 0) = 1e10f;
  EXPECT_EQ(compare_images(b, a, {.fail_percent = 0}).verdict, Verdict::kDiffers);
  b.at(3, 3, 0) = 9.9e9f;  // as far as a half-precision copy may be off
  EXPECT_EQ(compare_images(b, a, {.fail_percent = 0}).verdict, Verdict::kWithin);
}

TEST(CompareImages, NormalsAndIdsHaveLimitsOfTheirOwn) {
  const Image image = render_ball();
  Image other = image;
  other.at(47, 36, 5) += 0.04f;
  EXPECT_EQ(compare_images(other, image, {}).failing_pixels, 0u);
  other.at(47, 36, 5) += 0.04f;
  EXPECT_EQ(compare_images(other, image, {}).failing_pixels, 1u);
  other = image;
  other.at(47, 36, 8) = 1;
  EXPECT_EQ(compare_images(other, image, {}).failing_pixels, 1u);
}

TEST(CompareImages, NegativeAlphaFails) {
  Image image = render_ball();
  Image other = image;
  other.at(1, 1, 3) = -1e-6f;
  const Comparison result = compare_images(other, image, {});
  EXPECT_EQ(result.verdict, Verdict::kDiffers);
  EXPECT_EQ(result.negative_alpha_pixels, 1u);
  EXPECT_EQ(compare_images(other, other, {}).verdict, Verdict::kDiffers);
}

TEST(CompareImages, FailPercentIsTheBorder) {
  const Image a = make_image(100, 10, {"R"});
  Image b = a;
  b.at(0, 0, 0) = 1;
  EXPECT_EQ(compare_images(b, a, {.fail_percent = 0.1f}).verdict, Verdict::kWithin);
  b.at(1, 0, 0) = 1;
  EXPECT_EQ(compare_images(b, a, {.fail_percent = 0.1f}).verdict, Verdict::kDiffers);
}

TEST(CompareImages, FiguresAreThoseOfTheDefinitions) {
  Image a = make_image(2, 2, {"R", "G", "B"}), b = a;
  b.at(1, 0, 0) = 0.5f;
  b.at(0, 1, 0) = -0.1f;  // clipped away in the PSNR only
  const Comparison result = compare_images(b, a, {});
  ASSERT_EQ(result.channels.size(), 3u);
  const ChannelDifference& red = result.channels[0];
  EXPECT_EQ(red.channel, "R");
  EXPECT_DOUBLE_EQ(red.max, 0.5);
  EXPECT_EQ(red.max_x, 1);
  EXPECT_EQ(red.max_y, 0);
  EXPECT_NEAR(red.mean, 0.15, 1e-7);
  EXPECT_NEAR(red.rms, std::sqrt((0.25 + 0.01) / 4), 1e-7);
  EXPECT_NEAR(result.psnr, 10 * std::log10(12 / 0.25), 1e-9);
}

TEST(CompareImages, IsTheSameForAnyThreadCount) {
  const Image image = render_ball(), other = with_noise(image, 0.02f);
  set_thread_count(1);
  const Comparison one = compare_images(other, image, {});
  set_thread_count(2);
  const Comparison two = compare_images(other, image, {});
  set_thread_count(0);
  EXPECT_EQ(one.reason, two.reason);
  EXPECT_EQ(one.psnr, two.psnr);
  for (std::size_t c = 0; c < one.channels.size(); ++c) {
    EXPECT_EQ(one.channels[c].mean, two.channels[c].mean);
    EXPECT_EQ(one.channels[c].rms, two.channels[c].rms);
  }
}

TEST(CompareImages, FlipHasLimitsOfItsOwn) {
  const Image image = colors_of(render_ball());
  const Image noisy = with_noise(image, 3 / 255.0f);
  const Tolerance lax{.fail = 1};
  const Comparison seen = compare_images(noisy, image, lax);
  EXPECT_EQ(seen.verdict, Verdict::kWithin) << seen.reason;
  ASSERT_TRUE(seen.flip);
  EXPECT_GT(seen.flip->mean, 0.01);
  EXPECT_GT(seen.flip->p99, seen.flip->mean);
  const auto limit = static_cast<float>(seen.flip->mean);
  EXPECT_TRUE(compare_images(noisy, image, {.fail = 1, .flip_mean = limit * 1.01f}).passed());
  const Comparison failed = compare_images(noisy, image, {.fail = 1, .flip_mean = limit * 0.99f});
  EXPECT_EQ(failed.verdict, Verdict::kDiffers);
  EXPECT_NE(failed.reason.find("FLIP"), std::string::npos) << failed.reason;
  EXPECT_FALSE(compare_images(noisy, image, {.fail = 1, .flip_p99 = limit}).passed());
  EXPECT_EQ(compare_images(image, image, {}).flip->max, 0);
  EXPECT_FALSE(compare_images(make_image(2, 2, {"Z"}), make_image(2, 2, {"Z"}), {}).flip);
}

TEST(CompareImages, AWarningIsNoFailure) {
  const Image image = render_ball();
  Image other = image;
  other.at(10, 10, 0) += 0.002f;
  other.at(11, 10, 4) += 5;  // sky: no depth either way
  EXPECT_FALSE(compare_images(other, image, {.fail = 1}).warned) << "off unless asked for";
  const Comparison warned = compare_images(other, image, {.fail = 1, .warn = 0.001f});
  EXPECT_TRUE(warned.warned);
  EXPECT_TRUE(warned.passed());
  EXPECT_EQ(warned.warning_pixels, 1u);
  EXPECT_FALSE(compare_images(other, image, {.fail = 1, .warn = 0.003f}).warned);
  EXPECT_FALSE(
      compare_images(other, image, {.fail = 1, .warn = 0.001f, .warn_percent = 0.1f}).warned);
}

TEST(CompareImages, MapsAndHistogramAgreeWithTheCounts) {
  const Image image = render_ball();
  Image other = with_noise(image, 5 / 255.0f);
  other.at(47, 36, 1) += 0.5f;
  other.at(3, 3, 2) = std::numeric_limits<float>::quiet_NaN();
  other.at(60, 60, 8) = 2;
  PixelMaps maps;
  const Comparison result = compare_images(other, image, kStrict, &maps);
  ASSERT_EQ(maps.states.size(), result.pixels);
  EXPECT_EQ(maps.flip.size(), result.pixels);
  const auto count = [&](PixelState state) {
    return static_cast<std::uint64_t>(std::count(maps.states.begin(), maps.states.end(), state));
  };
  EXPECT_EQ(count(PixelState::kNotFinite), 1u);
  EXPECT_EQ(count(PixelState::kHard), 1u);
  EXPECT_EQ(maps.states[36 * 96 + 47], PixelState::kHard);
  EXPECT_EQ(count(PixelState::kHard) + count(PixelState::kOver), result.failing_pixels);
  std::uint64_t all = 0, over = 0;
  for (std::size_t bin = 0; bin < result.histogram.pixels.size(); ++bin) {
    all += result.histogram.pixels[bin];
    if (bin >= LimitHistogram::kAtLimit) over += result.histogram.pixels[bin];
  }
  EXPECT_EQ(all, result.pixels - 1) << "all that is finite";
  EXPECT_EQ(over, result.failing_pixels);
  EXPECT_GT(over, 10u);
  EXPECT_GE(result.histogram.pixels.back(), 1u) << "an id is infinitely over its limit";
}

TEST(DifferenceTriptych, ShowsReferenceActualAndDifference) {
  Image reference = make_image(4, 3, {"Z", "R", "G", "B"}), actual = reference;
  reference.at(2, 1, 1) = 0.5f;
  actual.at(2, 1, 1) = 0.4f;
  actual.at(0, 0, 2) = NAN;
  const Image triptych = difference_triptych(actual, reference);
  EXPECT_EQ(triptych.width, 12);
  EXPECT_EQ(triptych.height, 3);
  EXPECT_EQ(triptych.at(2, 1, 0), 0.5f);
  EXPECT_EQ(triptych.at(4 + 2, 1, 0), 0.4f);
  EXPECT_NEAR(triptych.at(8 + 2, 1, 0), 0.8f, 1e-6f);
  EXPECT_EQ(triptych.at(8, 0, 1), 1.0f) << "not finite is white";
  EXPECT_EQ(triptych.at(8 + 1, 1, 1), 0.0f);
}

TEST(DifferenceTriptych, TakesImagesOfDifferentSizes) {
  const Image triptych =
      difference_triptych(make_image(2, 5, {"R", "G", "B"}), make_image(4, 3, {"Y"}));
  EXPECT_EQ(triptych.width, 12);
  EXPECT_EQ(triptych.height, 5);
  EXPECT_EQ(triptych.at(8 + 1, 1, 0), 0.0f);
  EXPECT_EQ(triptych.at(8 + 3, 1, 0), 1.0f);
  EXPECT_EQ(triptych.at(8 + 1, 4, 0), 1.0f);
  EXPECT_EQ(triptych.at(8 + 3, 4, 0), 0.0f);
}

}  // namespace
}  // namespace polymorph
