// Look of mixtures: shares of colours, layers, labels.
#include "leg/weighted_look.h"

#include <gtest/gtest.h>

#include "testing/leg.h"

namespace polymorph {
namespace {

TEST(WeightedLook, TwoObjectsShareColorsAsAMorphDoes) {
  for (const float u : {0.0f, 0.1f, 0.3f, 0.5f, 0.75f, 1.0f}) {
    const std::vector<float> shares = color_shares(std::vector<float>{1 - u, u});
    EXPECT_NEAR(shares[1], color_fade(u).color, 1e-6f);
    EXPECT_NEAR(shares[0] + shares[1], 1, 1e-6f);
  }
}

TEST(WeightedLook, ManyObjectsShareColorsEvenlyWhereTheirWeightsAreEqual) {
  for (const std::size_t count : {3u, 8u}) {
    const std::vector<float> weights(count, 1 / static_cast<float>(count));
    for (const float share : color_shares(weights))
      EXPECT_NEAR(share, 1 / static_cast<float>(count), 1e-6f);
  }
  const std::vector<float> shares = color_shares(std::vector<float>{0.9f, 0.05f, 0.05f});
  EXPECT_EQ(shares, (std::vector<float>{1, 0, 0}));
}

class MixedLook : public ::testing::Test {
 protected:
  /// Makes a space of three shapes whose labels are 0, 1 and 2.
  static ShapeSpace make_space(Engine& engine) {
    const auto cube = make_test_object("cube", {}, 0, engine);
    std::vector<std::shared_ptr<const Leg>> legs;
    for (const auto& other : {make_test_object("sphere", {0.2f, 0, 0}, 1, engine),
                              make_test_object("torus", {0, 0.2f, 0}, 2, engine)}) {
      PlanSide from, to;
      from.balls = cube->balls, to.balls = other->balls;
      LegTiming timing;
      timing.interpolation = Interpolation::kDistance;
      LegParts parts{cube, other, {}, {}};
      parts.plan = plan_morph(from, to, FieldKind::kGaussian, {}, timing.motion);
      auto leg = make_leg(std::move(parts), timing, test_leg_settings(), engine, {});
      EXPECT_TRUE(leg.ok());
      legs.push_back(*leg);
    }
    auto space = make_shape_space(legs, engine);
    EXPECT_TRUE(space.ok());
    return *space;
  }
};

TEST_F(MixedLook, LayersLabelsAndNormalsFollowTheWeights) {
  const auto engine = make_cpu_engine();
  const ShapeSpace space = make_space(*engine);
  const std::vector<float> weights = {0.2f, 0.3f, 0.5f};
  const auto mixture = mix_objects(space, weights);
  ASSERT_TRUE(mixture.ok());
  auto surface = weighted_surface(*mixture, *engine);
  ASSERT_TRUE(surface.ok());
  auto pulled = pull_mixture_back(*mixture, *surface, *engine);
  ASSERT_TRUE(pulled.ok());
  const SurfaceLook look = weighted_look(*pulled, surface->mesh.triangles);
  ASSERT_EQ(look.layers.size(), 3u);
  EXPECT_EQ(look.layers[0].opacity, 1);
  const std::vector<float> shares = color_shares(weights);
  EXPECT_NEAR(look.layers[2].opacity, shares[2], 1e-6f);
  EXPECT_NEAR((1 - look.layers[2].opacity) * look.layers[1].opacity, shares[1], 1e-6f);
  for (const std::uint32_t label : weighted_labels(*pulled)) EXPECT_EQ(label, 2u);
  // Far from all objects the normals are the surface's own.
  Mesh same = surface->mesh;
  blend_weighted_normals(*pulled, same);
  EXPECT_EQ(same.normals, surface->mesh.normals);
}

}  // namespace
}  // namespace polymorph
