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
    ShapeSpace made;
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
      made.legs.push_back(*leg);
    }
    return made;
  }
  static Mesh mixed(const ShapeSpace& of, const std::vector<float>& weights) {
    auto mesh = weighted_surface(of, weights, *engine);
    EXPECT_TRUE(mesh.ok()) << (mesh.ok() ? "" : mesh.error().message);
    return mesh.ok() ? *mesh : Mesh{};
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

TEST_F(WeightedSurfaceTest, ObjectsOfWeight0LeaveNoTrace) {
  const ShapeSpace two{{space.legs[0]}};
  EXPECT_EQ(mixed(space, {0.4f, 0.6f, 0}).positions, mixed(two, {0.4f, 0.6f}).positions);
}

TEST_F(WeightedSurfaceTest, TheReferenceDoesNotDependOnTheOrder) {
  Objects list = objects;
  const auto reference = list[choose_reference(list)];
  std::reverse(list.begin(), list.end());
  EXPECT_EQ(list[choose_reference(list)], reference);
}

TEST_F(WeightedSurfaceTest, WeightsThatAreNoneAreErrors) {
  for (const std::vector<float>& weights :
       {std::vector<float>{0.5f, 0.25f, 0.5f}, std::vector<float>{1.5f, -0.5f, 0}}) {
    const auto mesh = weighted_surface(space, weights, *engine);
    ASSERT_FALSE(mesh.ok());
    EXPECT_EQ(mesh.error().code, ErrorCode::kInput);
  }
}

}  // namespace
}  // namespace polymorph
