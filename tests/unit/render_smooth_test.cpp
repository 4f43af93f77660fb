// Smoothing of noise: what is even loses it, edges and textures stay as they are.
#include "render/film/smooth.h"

#include "base/parallel.h"
#include "base/random.h"
#include "image/image_io.h"
#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

constexpr int kWidth = 60, kHeight = 40;

/// A wall that faces the camera, under noisy light of mean 1. `albedo` and `id` per pixel.
template <class Albedo, class Id>
Image noisy_wall(const Albedo& albedo, const Id& id, float noise) {
  Image film = make_image(
      kWidth, kHeight,
      {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "albedo.R", "albedo.G", "albedo.B", "id"});
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const float key =
          random_float(5, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y));
      const float light = 1 + noise * (2 * key - 1);
      for (int c = 0; c < 3; ++c) {
        film.at(x, y, c) = light * albedo(x, y);
        film.at(x, y, 8 + c) = albedo(x, y);
      }
      film.at(x, y, 3) = 1;
      film.at(x, y, 4) = 5;
      film.at(x, y, 7) = 1;
      film.at(x, y, 11) = id(x, y);
    }
  return film;
}
const auto kOneId = [](int, int) { return 2.0f; };
const auto kGrey = [](int, int) { return 0.5f; };

double rms(const Image& a, const Image& b) {
  double sum = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      for (int c = 0; c < 3; ++c) {
        const double d = static_cast<double>(a.at(x, y, c)) - static_cast<double>(b.at(x, y, c));
        sum += d * d;
      }
  return std::sqrt(sum / (3.0 * a.width * a.height));
}

TEST(Smooth, NoiseOfAnEvenWallGoes) {
  const Image clean = noisy_wall(kGrey, kOneId, 0), noisy = noisy_wall(kGrey, kOneId, 0.5f);
  Image film = noisy;
  smooth_noise(film);
  EXPECT_LT(rms(film, clean), 0.15 * rms(noisy, clean));
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 3; c < 12; ++c) ASSERT_EQ(film.at(x, y, c), noisy.at(x, y, c));
}

TEST(Smooth, TexturesKeepTheirContrast) {
  // Broad stripes with a soft gradient: where they meet, pixels stay between both.
  const auto stripes = [](int x, int) {
    return (x / 10 % 2 == 0 ? 0.2f : 0.8f) + 0.004f * static_cast<float>(x % 10);
  };
  const Image clean = noisy_wall(stripes, kOneId, 0), noisy = noisy_wall(stripes, kOneId, 0.4f);
  Image film = noisy;
  smooth_noise(film);
  EXPECT_LT(rms(film, clean), 0.6 * rms(noisy, clean));
  for (int y = 4; y < kHeight - 4; ++y)
    for (int x = 0; x < kWidth; ++x)
      EXPECT_NEAR(film.at(x, y, 0), clean.at(x, y, 0), 0.41f * stripes(x, y)) << x << ", " << y;
  // Without noise nothing changes, not even beside an edge.
  film = clean;
  smooth_noise(film);
  EXPECT_LT(rms(film, clean), 1e-6);
}

TEST(Smooth, LightDoesNotCrossEdges) {
  // Two objects in other light, in front of nothing.
  const auto id = [](int x, int) { return x < 20 ? 2.0f : x < 40 ? 3.0f : 0.0f; };
  Image film = noisy_wall(kGrey, id, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) film.at(x, y, c) = x < 20 ? 0.05f : x < 40 ? 0.7f : 0.3f;
  const Image before = film;
  smooth_noise(film);
  EXPECT_LT(rms(film, before), 1e-6);
}

TEST(Smooth, SilhouettesAreNotFrayed) {
  // Where an object ends, pixels show any mixture of it and of the wall behind it.
  const auto id = [](int x, int) { return x < 30 ? 2.0f : 1.0f; };
  const auto albedo = [&](int x, int y) { return id(x, y) > 1 ? 0.8f : 0.2f; };
  Image noisy = noisy_wall(albedo, id, 0), even = noisy;
  for (int y = 0; y < kHeight; ++y)
    for (const int x : {29, 30})
      for (int c = 0; c < 3; ++c) {
        const float share =
            random_float(7, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y));
        noisy.at(x, y, c) = 0.2f + 0.6f * share;
        even.at(x, y, c) = 0.5f;
      }
  Image film = noisy;
  smooth_noise(film);
  EXPECT_LT(rms(film, even), 0.55 * rms(noisy, even));
}

TEST(Smooth, OnePixelThatIsNoNumberStaysAlone) {
  Image film = noisy_wall(kGrey, kOneId, 0.3f);
  film.at(20, 20, 5) = std::nanf("");
  film.at(30, 20, 9) = std::nanf("");
  film.at(40, 20, 0) = std::numeric_limits<float>::infinity();
  smooth_noise(film);
  int odd = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) odd += !std::isfinite(film.at(x, y, c));
  EXPECT_LE(odd, 1);
  // On a silhouette, too.
  film = noisy_wall(
      kGrey, [](int x, int) { return x < 30 ? 2.0f : 1.0f; }, 0.3f);
  film.at(29, 20, 0) = std::nanf("");
  smooth_noise(film);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      EXPECT_EQ(std::isfinite(film.at(x, y, 0)), x != 29 || y != 20) << x << ", " << y;
}

TEST(Smooth, BitsAreTheSameEverywhere) {
  const auto stripes = [](int x, int) { return x / 15 % 2 == 0 ? 0.3f : 0.6f; };
  Image film = noisy_wall(stripes, kOneId, 0.5f), again = film;
  smooth_noise(film);
  set_thread_count(1);
  smooth_noise(again);
  set_thread_count(0);
  EXPECT_EQ(film.pixels, again.pixels);
  EXPECT_EQ(pixel_digest(film), "71bd2b78a2bc4ca3b27782f9fa15685b");
}

TEST(Smooth, BitsAreTheSameForRowsOfAnyLength) {
  // Two objects, a jump of depth, stripes, and nothing behind them.
  const auto id = [](int x, int y) { return y < 12 ? 0.0f : x + y < 45 ? 2.0f : 3.0f; };
  const auto stripes = [](int x, int) { return x / 6 % 3 == 0 ? 0.3f : 0.6f; };
  Image wall = noisy_wall(stripes, id, 0.5f);
  for (int y = 25; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) wall.at(x, y, 4) = 7;
  const auto smooth_parts = [](const Image& whole) {
    std::vector<std::string> digests;
    for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {8, 30}, {9, 17}, {60, 40}}) {
      Image film = make_image(width, height, whole.channels);
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          for (int c = 0; c < 12; ++c) film.at(x, y, c) = whole.at(x, y + kHeight - height, c);
      smooth_noise(film);
      digests.push_back(pixel_digest(film));
    }
    return digests;
  };
  const std::vector<std::string> digests = smooth_parts(wall);
  EXPECT_EQ(digests, (std::vector<std::string>{
                         "983acddb1cfd59aa381b896519400986", "94f27844228b294d68ccf80d4f9aa8dc",
                         "abfad0a208cc4181a1fb338e7884e053", "f99239f21f6621efd5f2485817afd5e4",
                         "5c70d1c79bb06d76f2c9d129f744cf9e"}));
  // What an earlier film left in memory does not matter.
  Image other = wall;
  for (float& value : other.pixels) value = -1e30f;
  smooth_parts(other);
  EXPECT_EQ(smooth_parts(wall), digests);
}

TEST(Smooth, ARenderedImageComesNearToOneOfManySamples) {
  const BallOnFloor stage;
  RenderSettings settings = small_settings(2);
  settings.image.width = 96;
  settings.image.height = 72;
  settings.image.max_depth = 1;
  settings.image.aovs = "id";
  const Image noisy = render_or_fail(stage.scene, settings);
  settings.image.smooth = true;
  const Image smooth = render_or_fail(stage.scene, settings);
  EXPECT_EQ(smooth.channels, noisy.channels) << "the guides are gone";
  for (int y = 0; y < smooth.height; ++y)
    for (int x = 0; x < smooth.width; ++x)
      for (int c = 3; c < 5; ++c) ASSERT_EQ(smooth.at(x, y, c), noisy.at(x, y, c));
  settings.image.smooth = false;
  settings.image.samples = 256;
  const Image many = render_or_fail(stage.scene, settings);
  EXPECT_LT(rms(smooth, many), 0.6 * rms(noisy, many));
  // A single sample is that of the pixel's centre, whose ray the guides have cast.
  settings.image.samples = 1;
  settings.image.smooth = true;
  Renderer renderer = *Renderer::create();
  EXPECT_LT(rms(*renderer.render(stage.scene, settings), many), 0.6 * rms(noisy, many));
  const Image sky = *renderer.render(furnace(), settings);
  EXPECT_EQ(renderer.stats().rays, static_cast<std::uint64_t>(sky.width * sky.height));
  // A lens blurs what the guides show sharp.
  RenderScene blurred = stage.scene;
  blurred.camera.lens_radius = 0.1f;
  blurred.camera.focus = 4;
  settings.image.samples = 2;
  const Image plain = render_or_fail(blurred, settings);
  settings.image.smooth = true;
  EXPECT_EQ(render_or_fail(blurred, settings).pixels, plain.pixels);
}

}  // namespace
}  // namespace polymorph
