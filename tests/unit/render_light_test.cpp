#include <gtest/gtest.h>

#include <cmath>

#include "render/lights/lights.h"
#include "render/lights/sky.h"
#include "render/math/sampler.h"

namespace polymorph {
namespace {

/// A dim gradient with one bright patch.
Image patchy_sky() {
  Image image = make_image(64, 32, {"R", "G", "B"});
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) {
      const bool patch = x >= 40 && x < 44 && y >= 8 && y < 11;
      for (int c = 0; c < 3; ++c)
        image.at(x, y, c) = (patch ? 80.0f : 0.0f) + 0.2f + 0.01f * static_cast<float>(y);
    }
  return image;
}

template <class F>
double sphere_integral(const F& f) {
  constexpr int kRows = 1024, kColumns = 1024;
  double sum = 0;
  for (int i = 0; i < kRows; ++i)
    for (int j = 0; j < kColumns; ++j) {
      const float y = 1 - 2 * (static_cast<float>(i) + 0.5f) / kRows;
      const float r = std::sqrt(1 - y * y), a = 2 * kPi * (static_cast<float>(j) + 0.5f) / kColumns;
      sum += f(Vec3{r * std::cos(a), y, r * std::sin(a)});
    }
  return sum * 4 * kPi / kRows / kColumns;
}

TEST(Sky, ImageDirectionsAreAsDocumented) {
  Image image = make_image(4, 3, {"R", "G", "B"});
  image.at(0, 1, 0) = 1;  // a quarter left of the middle column's left edge: behind and to the left
  image.at(2, 1, 1) = 1;
  image.at(0, 0, 2) = image.at(1, 0, 2) = image.at(2, 0, 2) = image.at(3, 0, 2) = 1;
  const Sky sky = make_image_sky(image, 1, SkyDomain::kAll);
  EXPECT_NEAR(sky_radiance(sky, Vec3{0, 1, 0}).z, 1, 1e-4f);  // row 0 is the zenith
  // Column 2's centre is an eighth of a turn right of -z, column 0's an eighth left of +z.
  const float h = std::sqrt(0.5f);
  EXPECT_NEAR(sky_radiance(sky, Vec3{h, 0, -h}).y, 1, 1e-4f);
  EXPECT_NEAR(sky_radiance(sky, Vec3{-h, 0, h}).x, 1, 1e-4f);
  EXPECT_NEAR(sky_radiance(sky, Vec3{0, -1, 0}).z, 0, 1e-4f);
}

TEST(Sky, DensityIsADensityAndSamplesFollowIt) {
  const Sky sky = make_image_sky(patchy_sky(), 1, SkyDomain::kAll);
  EXPECT_NEAR(sphere_integral([&](Vec3 d) { return bright_sky_pdf(sky, d); }), 1, 0.01);
  constexpr int kCount = 65536;
  const FrameSampler frame = make_frame_sampler(1, 0, kCount);
  double power = 0, disagree = 0;
  for (std::uint32_t s = 0; s < kCount; ++s) {
    const Sample4 r = PathSampler(frame, 0, 0, s).get(0);
    const SkySample sample = sample_bright_sky(sky, r.a, r.b);
    EXPECT_NEAR(length(sample.direction), 1, 1e-4f);
    power +=
        split_radiance(sky, sky_radiance(sky, sample.direction)).bright.y / sample.pdf / kCount;
    disagree += std::fabs(bright_sky_pdf(sky, sample.direction) / sample.pdf - 1) > 1e-3f;
  }
  EXPECT_LT(disagree, 0.005 * kCount);  // only next to the edges of cells
  EXPECT_NEAR(power, sphere_integral([&](Vec3 d) {
                return split_radiance(sky, sky_radiance(sky, d)).bright.y;
              }),
              0.005 * power);
}

TEST(Sky, SamplesStayAboveTheHorizonWhenAsked) {
  const Sky sky = make_image_sky(patchy_sky(), 1, SkyDomain::kAboveHorizon);
  const FrameSampler frame = make_frame_sampler(1, 0, 256);
  for (std::uint32_t s = 0; s < 256; ++s) {
    const Sample4 r = PathSampler(frame, 0, 0, s).get(0);
    EXPECT_GE(sample_bright_sky(sky, r.a, r.b).direction.y, -1e-5f);
  }
  EXPECT_EQ(bright_sky_pdf(sky, normalized(Vec3{0.3f, -0.5f, 0.2f})), 0.0f);
}

TEST(Sky, IrradianceIsTheCosineIntegral) {
  const Sky sky = make_image_sky(patchy_sky(), 1, SkyDomain::kAll);
  for (Vec3 n : {Vec3{0, 1, 0}, Vec3{0.6f, 0, -0.8f}, normalized(Vec3{-1, -2, 0.5f})}) {
    const double expected = sphere_integral([&](Vec3 d) {
      return split_radiance(sky, sky_radiance(sky, d)).calm.y * std::max(0.0f, dot(d, n));
    });
    EXPECT_NEAR(sky_irradiance(sky, n).y, expected, 0.02 * expected + 0.01);
  }
  const double floor = sphere_integral([&](Vec3 d) {
    return split_radiance(sky, sky_radiance(sky, d)).calm.y * std::max(0.0f, d.y);
  });
  EXPECT_NEAR(sky.upper_irradiance.y, floor, 0.01 * floor);
}

TEST(Sky, ConstantSkyIsExactEverywhere) {
  Image image = make_image(6, 3, {"R", "G", "B"});
  for (float& value : image.pixels) value = 0.5f;
  const Sky sky = make_image_sky(image, 2, SkyDomain::kAll);
  for (Vec3 n : {Vec3{1, 0, 0}, Vec3{0, -1, 0}, normalized(Vec3{1, 2, 3})})
    EXPECT_NEAR(sky_irradiance(sky, n).x, kPi, 1e-4f);
}

TEST(Sky, BadPixelsCountAsBlack) {
  Image image = make_image(4, 2, {"R", "G", "B"});
  for (float& value : image.pixels) value = std::nanf("");
  image.at(1, 0, 0) = 1;
  image.at(2, 0, 1) = -5;
  image.at(3, 1, 2) = INFINITY;
  const Sky sky = make_image_sky(image, 1, SkyDomain::kAll);
  for (Vec3 texel : sky.texels) EXPECT_TRUE(finite(texel) && texel.x >= 0 && texel.y == 0);
}

TEST(DistantLight, DiscGivesItsIrradiance) {
  LightSettings settings;
  settings.key_color = {1, 1, 1};
  settings.key_intensity = 3;
  for (float size : {0.0f, 0.5f, 12.0f, 90.0f}) {
    settings.key_size = size;
    const DistantLight key = make_key_light(settings, {});
    const FrameSampler frame = make_frame_sampler(2, 0, 4096);
    Vec3 facing, sum;
    for (std::uint32_t s = 0; s < 4096; ++s) {
      const Sample4 r = PathSampler(frame, 0, 0, s).get(0);
      const Vec3 d = sample_distant(key, r.a, r.b);
      EXPECT_TRUE(size == 0 || dot(d, key.frame.z) >= key.cos_radius - 1e-5f);
      facing = facing + key.sample_power * (dot(d, key.frame.z) / 4096.0f);
      sum = sum + d * (1.0f / 4096);
    }
    EXPECT_NEAR(facing.y, 3, 0.01f) << size;
    EXPECT_NEAR(dot(normalized(sum), key.frame.z), 1, 1e-4f);
  }
}

TEST(DistantLight, StandsRelativeToTheCamera) {
  LightSettings settings;
  settings.key_azimuth = -90;
  settings.key_elevation = 0;
  Camera camera;  // looks along -z
  EXPECT_NEAR(make_key_light(settings, camera).frame.z.x, -1, 1e-5f);
  camera.forward = {-1, 0, 0};  // from +x: its left is +z
  camera.right = {0, 0, -1};
  EXPECT_NEAR(make_key_light(settings, camera).frame.z.z, 1, 1e-5f);
}

TEST(DistantLight, ClearMeansNoRayToItMeetsTheSphere) {
  LightSettings settings;
  settings.key_size = 20;
  const DistantLight key = make_key_light(settings, {});
  const FrameSampler frame = make_frame_sampler(3, 0, 256);
  int clear = 0, hidden = 0;
  for (int i = 0; i < 400; ++i) {
    const Vec3 point{-4 + 0.4f * static_cast<float>(i % 20), -1,
                     -4 + 0.4f * static_cast<float>(i / 20)};
    bool meets = false;
    for (std::uint32_t s = 0; s < 256 && !meets; ++s) {
      const Sample4 r = PathSampler(frame, i, 0, s).get(0);
      const Vec3 d = sample_distant(key, r.a, r.b);
      const float along = -dot(point, d);
      meets = along > 0 && dot(point, point) - along * along < 1;
    }
    const bool says_clear = is_light_unoccluded(key, point, {}, 1);
    EXPECT_FALSE(says_clear && meets);
    clear += says_clear;
    hidden += meets;
  }
  EXPECT_GT(clear, 200);
  EXPECT_GT(hidden, 20);
}

TEST(Studio, FloorIsLitAsItsOwnSkySays) {
  const DistantLight key = make_key_light({}, {});
  const Vec3 floor{0.3f, 0.4f, 0.5f};
  const Sky sky = make_studio_sky(make_rig({}), key, floor, 1, SkyDomain::kAboveHorizon);
  const Vec3 irradiance = key.irradiance * key.frame.z.y + sky.upper_irradiance;
  const Vec3 below = sky_radiance(sky, Vec3{0, -1, 0});
  EXPECT_NEAR(below.x, floor.x * kInvPi * irradiance.x, 0.01f * below.x);
  EXPECT_NEAR(below.z, floor.z * kInvPi * irradiance.z, 0.01f * below.z);
}

}  // namespace
}  // namespace polymorph
