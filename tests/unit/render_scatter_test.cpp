#include "render/path/scatter.h"

#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

/// A calm sky that is brighter on one side and above.
Image sloping_sky() {
  Image image = make_image(32, 16, {"R", "G", "B"});
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 32; ++x)
      for (int c = 0; c < 3; ++c)
        image.at(x, y, c) = 1 + 0.5f * std::sin(kPi * static_cast<float>(x) / 16) +
                            0.05f * static_cast<float>(16 - y);
  return image;
}

/// Mean and standard deviation of a colour's green over the numbers of one pixel's samples.
template <class F>
std::pair<double, double> moments(const F& f) {
  constexpr int kCount = 1 << 15;
  const FrameSampler frame = make_frame_sampler(3, 0, kCount);
  double sum = 0, sum2 = 0;
  for (std::uint32_t s = 0; s < kCount; ++s) {
    const Sample4 r = PathSampler(frame, 0, 0, s).get(1);
    const double value = f(r.c, r.d).y;
    sum += value / kCount;
    sum2 += value * value / kCount;
  }
  return {sum, std::sqrt(std::max(0.0, sum2 - sum * sum))};
}

TEST(Scatter, TheGlossSkyHasTheMeanOfBsdfSamplesAndLessNoise) {
  const Sky sky = make_image_sky(sloping_sky(), 1, SkyDomain::kAll);
  const SkyTables tables(sky);
  const Vec3 normal = normalized(Vec3{0.3f, 0.8f, 0.5f});
  for (const float roughness : {0.05f, 0.3f, 0.7f, 1.0f})
    for (const float metallic : {0.0f, 0.6f, 1.0f})
      for (const float cosine : {0.15f, 0.6f, 0.98f}) {
        const Vec3 tangent = normalized(cross(normal, Vec3{1, 0, 0}));
        const Vec3 view = normal * cosine + tangent * std::sqrt(1 - cosine * cosine);
        const Shading shading{{0.7f, 0.6f, 0.5f}, {0.04f, 0.04f, 0.04f}, roughness, metallic};
        const Bsdf bsdf = make_bsdf(shading, shading, 0.0f, normal, view);
        const auto [mean, deviation] = moments([&](float u, float v) {
          const Vec3 local = sample_bsdf(bsdf, u, v);
          const BsdfValue value = evaluate_bsdf(bsdf, local);
          if (!(value.pdf > 0)) return Vec3{};
          const Vec3 diffuse = bsdf.diffuse_albedo * (kInvPi * local.z);
          return (value.value - diffuse) / value.pdf *
                 sky_radiance(tables, to_world(bsdf.frame, local));
        });
        const auto [estimate, noise] =
            moments([&](float u, float v) { return estimate_gloss_sky(tables, bsdf, u, v); });
        SCOPED_TRACE(::testing::Message() << "roughness " << roughness << ", metallic " << metallic
                                          << ", cosine " << cosine);
        EXPECT_NEAR(estimate, mean, 0.01 * std::abs(mean) + 5e-4);
        EXPECT_LT(noise, 0.8 * deviation + 1e-3);
      }
}

TEST(Scatter, DirectionsTowardsTheObjectsHaveTheMeanOfThoseByTheCosineAndLessNoise) {
  World world;
  world.bounds = {{-1, 0.2f, -0.5f}, {1, 1.7f, 0.5f}};
  world.center = world.bounds.center();
  world.upright_radius = std::sqrt(1.25f);
  for (const float distance : {1.2f, 1.6f, 2.5f, 6.0f, 12.0f})
    for (const float turn : {0.0f, 0.3f, 2.0f}) {
      const Vec3 origin{distance * std::sin(turn), 0, distance * std::cos(turn)};
      // The share of an even sky that the box around the objects hides.
      const auto hidden = [&](bool may_aim) {
        return moments([&, may_aim](float u, float v) {
          const auto sample = sample_floor_direction(world, origin, u, v, may_aim);
          EXPECT_EQ(sample.aimed, may_aim);
          const bool hit = !misses_box(world.bounds, Ray{origin, sample.direction});
          return Vec3{0, hit ? sample.weight : 0, 0};
        });
      };
      const auto [by_cosine, deviation] = hidden(false);
      const auto [aimed, noise] = hidden(true);
      SCOPED_TRACE(::testing::Message() << distance << " away, turned by " << turn);
      EXPECT_NEAR(aimed, by_cosine, 0.005 * by_cosine + 1e-4);
      EXPECT_LT(noise, 0.75 * deviation);
    }
  // Within the cylinder the objects may be anywhere.
  EXPECT_FALSE(sample_floor_direction(world, Vec3{0.5f, 0, 0.9f}, 0.4f, 0.3f, true).aimed);
}

}  // namespace
}  // namespace polymorph
