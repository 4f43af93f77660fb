// Mixtures of several objects: ends, volumes, order.
#include "leg/weighted_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "mesh/components.h"
#include "mesh/mesh_check.h"
#include "testing/leg.h"

namespace polymorph {
namespace {

using Objects = std::vector<std::shared_ptr<const PreparedObject>>;

class WeightedSurfaceTest : public ::testing::Test {
 protected:
  /// Makes the space of some objects, whose reference is the first.
  static ShapeSpace make_space(const Objects& chosen) {
    std::vector<std::shared_ptr<const Leg>> legs;
    for (std::size_t i = 1; i < chosen.size(); ++i) {
      LegParts parts{chosen[0], chosen[i], {}, {}};
      PlanSide from, to;
      from.balls = chosen[0]->balls;
      to.balls = chosen[i]->balls;
      LegTiming timing;
      timing.interpolation = Interpolation::kDistance;
      parts.plan = plan_morph(from, to, FieldKind::kGaussian, {}, timing.motion);
      auto leg = make_leg(std::move(parts), timing, test_leg_settings(), *engine, {});
      EXPECT_TRUE(leg.ok());
      legs.push_back(*leg);
    }
    auto made = make_shape_space(legs, *engine);
    EXPECT_TRUE(made.ok());
    return *made;
  }
  static Mesh mixed(const ShapeSpace& of, const std::vector<float>& weights) {
    auto mixture = mix_objects(of, weights);
    EXPECT_TRUE(mixture.ok()) << (mixture.ok() ? "" : mixture.error().message);
    if (!mixture.ok()) return {};
    auto surface = weighted_surface(*mixture, *engine);
    EXPECT_TRUE(surface.ok());
    return surface.ok() ? surface->mesh : Mesh{};
  }
  /// Made once: their distances and paces take seconds.
  static void SetUpTestSuite() {
    engine = make_cpu_engine();
    objects = {make_test_object("cube", {}, 0, *engine),
               make_test_object("sphere", {0.8f, 0, 0}, 1, *engine),
               make_test_object("torus", {0, 0.5f, 0}, 2, *engine)};
    space = make_space(objects);
  }
  static void TearDownTestSuite() { engine.reset(), objects.clear(), space = {}; }
  static inline std::unique_ptr<Engine> engine;
  static inline Objects objects;
  static inline ShapeSpace space;
};

TEST_F(WeightedSurfaceTest, AWeightOf1IsTheObjectsOwnSurface) {
  for (std::size_t i = 0; i < 3; ++i) {
    std::vector<float> weights(3, 0.0f);
    weights[i] = 1;
    const Mesh mesh = mixed(space, weights);
    const auto own = extract_distances(*engine, objects[i]->distances.grid,
                                       test_leg_settings().cell, test_leg_settings().shown);
    ASSERT_TRUE(own.ok());
    EXPECT_EQ(mesh.positions, own->positions);
  }
}

TEST_F(WeightedSurfaceTest, MixturesAreClosedWholeAndHaveTheMeanVolume) {
  for (const std::array<float, 3> weights :
       {std::array{0.5f, 0.25f, 0.25f}, std::array{0.25f, 0.5f, 0.25f},
        std::array{0.5f, 0.5f, 0.0f}, std::array{0.0f, 0.5f, 0.5f}}) {
    const Mesh mesh = mixed(space, {weights.begin(), weights.end()});
    ASSERT_FALSE(mesh.positions.empty());
    EXPECT_TRUE(check_mesh(mesh).is_closed());
    EXPECT_EQ(smallest_component_share(mesh), 1);
    double volume = 0;
    Vec3 place;
    for (std::size_t i = 0; i < 3; ++i) {
      volume += static_cast<double>(weights[i]) * objects[i]->distances.volume;
      place = place + weights[i] * objects[i]->model.box().center();
    }
    EXPECT_NEAR(volume_of(mesh) / volume, 1, 0.02);
    Box box;
    for (const Vec3 p : mesh.positions) box = unite(box, {p, p});
    EXPECT_LT(length(box.center() - place), 0.1f);
  }
}

TEST_F(WeightedSurfaceTest, TheFieldIsZeroOnTheSurfaceAndPositiveInside) {
  for (const std::vector<float>& weights :
       {std::vector<float>{0.5f, 0.3f, 0.2f}, {0, 0.5f, 0.5f}, {0, 0, 1}}) {
    const auto mixture = mix_objects(space, weights);
    ASSERT_TRUE(mixture.ok());
    const auto surface = weighted_surface(*mixture, *engine);
    ASSERT_TRUE(surface.ok());
    const Mesh& mesh = surface->mesh;
    const float cell = mixture->settings.cell;
    std::vector<Vec3> inside = mesh.positions;
    for (std::size_t i = 0; i < inside.size(); ++i) inside[i] = inside[i] - mesh.normals[i] * cell;
    const auto on = weighted_field(*mixture, *surface, mesh.positions, *engine);
    const auto below = weighted_field(*mixture, *surface, inside, *engine);
    ASSERT_TRUE(on.ok() && below.ok());
    double mean = 0;
    std::size_t positive = 0;
    for (const float value : *on) mean += static_cast<double>(std::abs(value) / cell);
    for (const float value : *below) positive += value > 0 ? 1u : 0u;
    EXPECT_LT(mean / static_cast<double>(on->size()), 0.1);
    EXPECT_GT(static_cast<double>(positive), 0.98 * static_cast<double>(below->size()));
  }
}

TEST_F(WeightedSurfaceTest, ObjectsOfWeight0LeaveNoTrace) {
  const ShapeSpace two{{space.legs[0]}, {space.places[0], space.places[1]}};
  EXPECT_EQ(mixed(space, {0.4f, 0.6f, 0}).positions, mixed(two, {0.4f, 0.6f}).positions);
}

TEST_F(WeightedSurfaceTest, MapsAreTheIdentityAtTheObjects) {
  for (std::size_t i = 0; i < 3; ++i) {
    std::vector<float> weights(3, 0.0f);
    weights[i] = 1;
    const auto mixture = mix_objects(space, weights);
    ASSERT_TRUE(mixture.ok());
    ASSERT_EQ(mixture->objects.size(), 1u);
    const std::vector<Vec3> points = {objects[i]->model.box().center(),
                                      objects[i]->model.points[0]};
    const auto places = map_to_object(mixture->objects[0], 0, points, *engine);
    ASSERT_TRUE(places.ok());
    for (std::size_t k = 0; k < points.size(); ++k)
      EXPECT_LT(length((*places)[k] - points[k]), 1e-4f);
    const auto on_reference = map_to_reference(space, weights, 0, points, *engine);
    ASSERT_TRUE(on_reference.ok());
    if (i == 0) {
      EXPECT_EQ(*on_reference, *places);
    }
  }
}

TEST_F(WeightedSurfaceTest, TheFlowGoesToTheNextMixture) {
  const std::vector<float> now = {0.5f, 0.3f, 0.2f}, next = {0.4f, 0.2f, 0.4f};
  const auto mixture = mix_objects(space, now), later = mix_objects(space, next);
  ASSERT_TRUE(mixture.ok() && later.ok());
  std::vector<Vec3> points;
  for (const RegressionSample& ball : mixture->samples) points.push_back(ball.center);
  const auto still = weighted_flow(space, now, now, points, *engine);
  const auto flow = weighted_flow(space, now, next, points, *engine);
  ASSERT_TRUE(flow.ok() && still.ok());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(still->displacement[i], Vec3{});
    const Vec3 step = later->samples[i].center - points[i];
    EXPECT_LT(length(flow->displacement[i] - step), 0.5f * length(step) + 0.02f);
    EXPECT_NEAR(flow->progress[i], 0.5f, 1e-5f);
  }
}

TEST_F(WeightedSurfaceTest, WeightsThatAreNoneAreErrors) {
  for (const std::vector<float>& weights :
       {std::vector<float>{0.5f, 0.25f, 0.5f}, std::vector<float>{1.5f, -0.5f, 0}}) {
    const auto mixture = mix_objects(space, weights);
    ASSERT_FALSE(mixture.ok());
    EXPECT_EQ(mixture.error().code, ErrorCode::kInput);
  }
}

}  // namespace
}  // namespace polymorph
