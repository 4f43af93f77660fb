// Eight lanes are eight times one: what is written once for both gives the same numbers.
#include "render/math/simd.h"

#include "base/random.h"
#include "render/lights/backdrop.h"
#include "render/lights/lamps.h"
#include "render/lights/lights.h"
#include "render/lights/sky.h"
#include "render/materials/materials.h"
#include "render/math/sampler.h"
#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

float random_between(float low, float high, std::uint64_t key) {
  return low + (high - low) * random_float(11, key, 0);
}
Pack random_pack(float low, float high, std::uint64_t key) {
  Pack a;
  for (int l = 0; l < kLanes; ++l)
    a[l] = random_between(low, high, key * kLanes + static_cast<std::uint64_t>(l));
  return a;
}
Pack3 random_directions(std::uint64_t key) {
  return normalized(Pack3{random_pack(-1, 1, 3 * key), random_pack(-1, 1, 3 * key + 1),
                          random_pack(-1, 1, 3 * key + 2)});
}
void expect_same(float one, Pack eight, int l) { EXPECT_EQ(one, eight[l]) << "lane " << l; }
void expect_same(Vec3 one, const Pack3& eight, int l) { EXPECT_EQ(one, lane(eight, l)) << l; }

constexpr int kRounds = 200;

TEST(Lanes, RowsBecomeColumnsAndRowsAgain) {
  float numbers[kLanes][24], back[kLanes][24];
  const float* from[kLanes];
  float* to[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    for (int i = 0; i < 24; ++i) numbers[l][i] = static_cast<float>(100 * l + i);
    from[l] = numbers[l];
    to[l] = back[l];
  }
  Pack columns[24];
  load_rows<24>(from, columns);
  store_rows<24>(columns, to);
  for (int l = 0; l < kLanes; ++l)
    for (int i = 0; i < 24; ++i) {
      EXPECT_EQ(columns[i][l], numbers[l][i]);
      EXPECT_EQ(back[l][i], numbers[l][i]);
    }
}

TEST(Lanes, SamplersDrawTheSameNumbers) {
  const FrameSampler frame = make_frame_sampler(3, 1, 16);
  PackBits index;
  for (int l = 0; l < kLanes; ++l)
    index[l] = sample_index(frame, 40 + l, 17, static_cast<std::uint32_t>(l)).reversed;
  const PathSamplerOf<Pack> eight(frame, 0, index);
  for (std::uint32_t set = 0; set < 5; ++set)
    for (int l = 0; l < kLanes; ++l) {
      const Sample4 one = PathSampler(frame, 40 + l, 17, static_cast<std::uint32_t>(l)).get(set);
      const Sample4Of<Pack> all = eight.get(set);
      expect_same(one.a, all.a, l);
      expect_same(one.b, all.b, l);
      expect_same(one.c, all.c, l);
      expect_same(one.d, all.d, l);
    }
}

TEST(Lanes, SamplesOfATileAreOfOneSequence) {
  // What a wave of paths takes for granted, at the largest picture and number of samples.
  const FrameSampler frame = make_frame_sampler(0, 0, 65536);
  const SampleIndex first = sample_index(frame, 16368, 16368, 0);
  const SampleIndex last = sample_index(frame, 16383, 16383, 65535);
  EXPECT_GT(first.sequence, 0u);
  EXPECT_EQ(first.sequence, last.sequence);
}

TEST(Lanes, MaterialsScatterTheSame) {
  // Eight different pairs of materials at once: metal, plastic, matte, black and mixtures.
  const Shading kinds[] = {{{0.9f, 0.6f, 0.3f}, {}, 0.2f, 1},
                           {{0.2f, 0.4f, 0.8f}, {0.04f, 0.04f, 0.04f}, 0.4f, 0},
                           {{0.7f, 0.7f, 0.7f}, {}, 1, 0},
                           {{0, 0, 0}, {}, 1, 0}};
  for (std::uint64_t round = 0; round < kRounds; ++round) {
    Shading a[kLanes], b[kLanes];
    ShadingOf<Pack3> all_a, all_b;
    Pack share;
    for (int l = 0; l < kLanes; ++l) {
      a[l] = kinds[random_u64(1, round, l) % 4];
      b[l] = kinds[random_u64(2, round, l) % 4];
      share[l] = 0.5f * static_cast<float>(random_u64(3, round, l) % 3);
      const auto put = [&](ShadingOf<Pack3>& all, const Shading& one) {
        set_lane(all.color, l, one.color);
        set_lane(all.specular, l, one.specular);
        all.roughness[l] = one.roughness;
        all.metallic[l] = one.metallic;
      };
      put(all_a, a[l]);
      put(all_b, b[l]);
    }
    const Pack3 normal = random_directions(5 * round), away = random_directions(5 * round + 1);
    const Pack3 view = away * copysign(broadcast<Pack>(1), dot(away, normal));
    const BsdfOf<Pack3> eight = make_bsdf(all_a, all_b, share, normal, view);
    const Pack u = random_pack(0, 1, 9000 + 2 * round), v = random_pack(0, 1, 9001 + 2 * round);
    const Pack3 there = random_directions(5 * round + 2), sampled = sample_bsdf(eight, u, v);
    const BsdfValueOf<Pack3> value = evaluate_bsdf(eight, there);
    for (int l = 0; l < kLanes; ++l) {
      const Bsdf one = make_bsdf(a[l], b[l], share[l], lane(normal, l), lane(view, l));
      expect_same(one.diffuse_albedo, eight.diffuse_albedo, l);
      expect_same(one.sharpest_alpha, eight.sharpest_alpha, l);
      EXPECT_EQ(one.has_gloss, eight.has_gloss[l] != 0);
      EXPECT_EQ(one.has_diffuse, eight.has_diffuse[l] != 0);
      expect_same(evaluate_bsdf(one, lane(there, l)).value, value.value, l);
      expect_same(evaluate_bsdf(one, lane(there, l)).pdf, value.pdf, l);
      expect_same(sample_bsdf(one, u[l], v[l]), sampled, l);
    }
  }
}

TEST(Lanes, LightsShineTheSame) {
  const Sky sky = make_image_sky(*constant_sky(1), 1, SkyDomain::kAll);
  Sky spotted = sky;
  spotted.texels[9] = {50, 40, 30};
  spotted.calm_level = 4;
  prepare_sky(spotted, SkyDomain::kAll);
  LampSettings settings[3];
  settings[0].kind = LampKind::kLamp;
  settings[0].radius = 0.3f;
  settings[1].kind = LampKind::kLamp;
  settings[1].radius = 0;
  settings[2].kind = LampKind::kPanel;
  settings[2].width = settings[2].height = 2;
  const DistantLight key = make_key_light({}, {});
  for (LampSettings& lamp : settings) {
    lamp.position = {0.5f, 2, 0.3f};
    const Lamp made = make_lamp(lamp, {});
    for (std::uint64_t round = 0; round < kRounds; ++round) {
      const Pack3 from = random_directions(2 * round), way = random_directions(2 * round + 1);
      const Pack u = random_pack(0, 1, 2 * round), v = random_pack(0, 1, 2 * round + 1);
      const LampSampleOf<Pack3> eight = sample_lamp(made, from, u, v);
      const Pack hit = intersect_lamp(made, RayOf<Pack3>{from, way});
      const Pack3 towards = sample_distant(key, u, v), radiance = sky_radiance(spotted, way);
      for (int l = 0; l < kLanes; ++l) {
        const LampSample one = sample_lamp(made, lane(from, l), u[l], v[l]);
        expect_same(one.power, eight.power, l);
        expect_same(one.pdf, eight.pdf, l);
        if (!(one.power == Vec3{})) {
          expect_same(one.direction, eight.direction, l);
          expect_same(one.distance, eight.distance, l);
        }
        expect_same(intersect_lamp(made, Ray{lane(from, l), lane(way, l)}), hit, l);
        expect_same(sample_distant(key, u[l], v[l]), towards, l);
        expect_same(sky_radiance(spotted, lane(way, l)), radiance, l);
        expect_same(sky_irradiance(spotted, lane(way, l)), sky_irradiance(spotted, way), l);
        expect_same(bright_sky_pdf(spotted, lane(way, l)), bright_sky_pdf(spotted, way), l);
      }
    }
  }
}

}  // namespace
}  // namespace polymorph
