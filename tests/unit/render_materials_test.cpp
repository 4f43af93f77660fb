#include "render/materials/materials.h"

#include <gtest/gtest.h>

#include <cmath>

#include "render/math/sampler.h"

namespace polymorph {
namespace {

const Vec3 kUp{0, 0, 1};

Vec3 view_at(float cosine) { return {std::sqrt(1 - cosine * cosine), 0, cosine}; }

/// Share of white light that the surface sends towards the viewer, by its own sampling.
Vec3 albedo(const Bsdf& bsdf, int samples = 1 << 14) {
  const FrameSampler frame = make_frame_sampler(5, 0, samples);
  Vec3 sum;
  for (int s = 0; s < samples; ++s) {
    const Sample4 r = PathSampler(frame, 0, 0, static_cast<std::uint32_t>(s)).get(0);
    const Vec3 direction = sample_bsdf(bsdf, r.a, r.b);
    const BsdfValue value = evaluate_bsdf(bsdf, direction);
    if (value.pdf > 0) sum = sum + value.value / value.pdf;
  }
  return sum / static_cast<float>(samples);
}

float share_above_horizon(const Bsdf& bsdf) {
  const FrameSampler frame = make_frame_sampler(6, 0, 4096);
  int above = 0;
  for (std::uint32_t s = 0; s < 4096; ++s) {
    const Sample4 r = PathSampler(frame, 0, 0, s).get(0);
    above += sample_bsdf(bsdf, r.a, r.b).z > 0;
  }
  return static_cast<float>(above) / 4096;
}

/// Albedo by even samples of the hemisphere, and the integral of the pdf.
struct Integral {
  float albedo, pdf;
};
Integral integrate(const Bsdf& bsdf) {
  constexpr int kSteps = 1024;
  double light = 0, pdf = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const float z = (static_cast<float>(i) + 0.5f) / kSteps;
      const float r = std::sqrt(1 - z * z), a = 2 * kPi * (static_cast<float>(j) + 0.5f) / kSteps;
      const BsdfValue value = evaluate_bsdf(bsdf, {r * std::cos(a), r * std::sin(a), z});
      light += value.value.y;
      pdf += value.pdf;
    }
  const double area = 2.0 * kPi / kSteps / kSteps;
  return {static_cast<float>(light * area), static_cast<float>(pdf * area)};
}

Shading metal(float roughness, Vec3 color = {1, 1, 1}) { return {color, color, roughness, 1}; }
Shading plastic(float roughness, Vec3 color = {1, 1, 1}) {
  return {color, {0.04f, 0.04f, 0.04f}, roughness, 0};
}
Bsdf one(const Shading& s, float cosine) { return make_bsdf(s, s, 0, kUp, view_at(cosine)); }

TEST(Materials, WhiteMetalLosesNoLight) {
  for (float roughness : {0.0f, 0.12f, 0.5f, 0.8f, 1.0f})
    for (float cosine : {0.2f, 0.6f, 0.97f})
      EXPECT_NEAR(albedo(one(metal(roughness), cosine)).y, 1, 0.015f)
          << "roughness " << roughness << " cosine " << cosine;
}

TEST(Materials, WhitePlasticLosesNoLight) {
  for (float roughness : {0.1f, 0.5f, 1.0f})
    for (float cosine : {0.2f, 0.6f, 0.97f})
      EXPECT_NEAR(albedo(one(plastic(roughness), cosine)).y, 1, 0.015f)
          << "roughness " << roughness << " cosine " << cosine;
}

TEST(Materials, MatteIsExactlyLambert) {
  const Shading grey{{0.3f, 0.5f, 0.7f}, {}, 1, 0};
  const Bsdf bsdf = one(grey, 0.4f);
  const BsdfValue value = evaluate_bsdf(bsdf, view_at(0.7f));
  EXPECT_NEAR(value.value.x, 0.3f * 0.7f * kInvPi, 1e-6f);
  EXPECT_NEAR(value.value.z, 0.7f * 0.7f * kInvPi, 1e-6f);
  EXPECT_NEAR(value.pdf, 0.7f * kInvPi, 1e-6f);
}

TEST(Materials, SamplingAgreesWithEvaluation) {
  const Shading cases[] = {metal(0.5f, {0.9f, 0.8f, 0.7f}), plastic(0.6f, {0.2f, 0.5f, 0.7f}),
                           plastic(0.4f), metal(1.0f)};
  for (const Shading& s : cases)
    for (float cosine : {0.3f, 0.9f}) {
      const Bsdf bsdf = one(s, cosine);
      const Integral integral = integrate(bsdf);
      EXPECT_NEAR(albedo(bsdf).y, integral.albedo, 0.01f);
      // Some directions of rough gloss lie below the horizon.
      EXPECT_NEAR(share_above_horizon(bsdf), integral.pdf, 0.01f);
    }
}

TEST(Materials, LightMayTravelBothWays) {
  for (const Shading& s : {metal(0.4f), plastic(0.5f, {0.6f, 0.6f, 0.6f})}) {
    const Vec3 a = view_at(0.35f), b{-0.3f, 0.5f, std::sqrt(1 - 0.34f)};
    const float there = evaluate_bsdf(make_bsdf(s, s, 0, kUp, a), b).value.y / b.z;
    const float back = evaluate_bsdf(make_bsdf(s, s, 0, kUp, b), a).value.y / a.z;
    if (s.metallic == 0) {
      EXPECT_NEAR(there, back, 0.01f * there);
    } else {
      // The compensation factor follows the viewer alone; it differs by a few per cent.
      EXPECT_NEAR(there, back, 0.08f * there);
    }
  }
}

TEST(Materials, AMixtureIsTheWeightedSum) {
  const Shading a = plastic(0.5f, {0.2f, 0.4f, 0.8f}), b = metal(0.2f);
  const Vec3 view = view_at(0.7f), light{-0.5f, 0.1f, std::sqrt(1 - 0.26f)};
  const Vec3 pure_a = evaluate_bsdf(make_bsdf(a, b, 0, kUp, view), light).value;
  const Vec3 pure_b = evaluate_bsdf(make_bsdf(a, b, 1, kUp, view), light).value;
  for (float share : {0.25f, 0.5f, 0.75f}) {
    const Vec3 mixed = evaluate_bsdf(make_bsdf(a, b, share, kUp, view), light).value;
    const Vec3 expected = lerp(pure_a, pure_b, share);
    EXPECT_NEAR(mixed.x, expected.x, 1e-5f);
    EXPECT_NEAR(mixed.z, expected.z, 1e-5f);
  }
  EXPECT_EQ(evaluate_bsdf(make_bsdf(a, b, 0, kUp, view), light).value,
            evaluate_bsdf(make_bsdf(a, a, 0, kUp, view), light).value);
}

TEST(Materials, BlackSurfacesScatterNothing) {
  const Shading black{{}, {}, 0.5f, 0};
  const Bsdf bsdf = one(black, 0.5f);
  EXPECT_EQ(evaluate_bsdf(bsdf, view_at(0.5f)).value, Vec3{});
  EXPECT_LE(sample_bsdf(bsdf, 0.3f, 0.3f).z, 0.0f);
}

}  // namespace
}  // namespace polymorph
