// The surface of a leg at a time, of both kinds of legs.
#include "leg/leg_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "leg/surface_look.h"
#include "mesh/components.h"
#include "mesh/mesh_check.h"
#include "testing/leg.h"

namespace polymorph {
namespace {

class LegSurfaceTest : public ::testing::TestWithParam<Interpolation> {
 protected:
  /// Made once for each kind.
  std::shared_ptr<const Leg> leg() {
    static std::map<Interpolation, std::shared_ptr<const Leg>> legs;
    std::shared_ptr<const Leg>& one = legs[GetParam()];
    if (!one) one = make_test_leg(GetParam(), *engine);
    return one;
  }
  const std::unique_ptr<Engine> engine = make_cpu_engine();
};

TEST_P(LegSurfaceTest, ItsKindIsDecidedByItsTiming) {
  const bool of_distances = visit(
      *leg(), [] { return false; }, [](const DistanceLeg&) { return true; });
  EXPECT_EQ(of_distances, GetParam() == Interpolation::kDistance);
}

TEST_P(LegSurfaceTest, TheVolumeGoesFromOneObjectsToTheOthers) {
  const auto one = leg();
  const bool of_distances = GetParam() == Interpolation::kDistance;
  const double from = of_distances ? one->from->distances.volume : one->from->ball_volume,
               to = of_distances ? one->to->distances.volume : one->to->ball_volume;
  for (const float time : {0.0f, 0.3f, 0.7f, 1.0f}) {
    const auto surface = leg_surface(*one, time, *engine);
    ASSERT_TRUE(surface.ok()) << surface.error().message;
    EXPECT_EQ(surface->state.time, time);
    const auto u = static_cast<double>(surface->state.u);
    EXPECT_NEAR(volume_of(surface->mesh) / ((1 - u) * from + u * to), 1, 0.01) << time;
    EXPECT_TRUE(check_mesh(surface->mesh).is_closed()) << time;
  }
}

TEST_P(LegSurfaceTest, PointsComeFromTheSourceAndGoToTheTarget) {
  const auto one = leg();
  for (const float time : {0.0f, 1.0f}) {
    const auto surface = leg_surface(*one, time, *engine);
    ASSERT_TRUE(surface.ok());
    const std::vector<Vec3>& points = surface->mesh.positions;
    const auto pulled = pull_back(*one, surface->state, points, *engine);
    ASSERT_TRUE(pulled.ok());
    const std::vector<Vec3>& own = time == 0 ? pulled->source : pulled->target;
    for (std::size_t i = 0; i < points.size(); ++i) ASSERT_LT(length(own[i] - points[i]), 1e-4f);
  }
}

TEST_P(LegSurfaceTest, MotionLeadsToTheNextSurface) {
  const auto one = leg();
  const auto now = leg_surface(*one, 0.4f, *engine), next = leg_surface(*one, 0.45f, *engine);
  ASSERT_TRUE(now.ok() && next.ok());
  const std::vector<Vec3>& points = now->mesh.positions;
  const auto still = flow_until(*one, now->state, {*one, 0.4f}, points, *engine);
  const auto flow = flow_until(*one, now->state, {*one, 0.45f}, points, *engine);
  ASSERT_TRUE(still.ok() && flow.ok());
  const ClosestPointQuery to_next(next->mesh.positions, next->mesh.triangles);
  double before = 0, after = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_LT(length(still->displacement[i]), 1e-6f);
    before += static_cast<double>(to_next.closest(points[i]).distance);
    after += static_cast<double>(to_next.closest(points[i] + flow->displacement[i]).distance);
  }
  // The rest is the change of shape and level, which no motion of points tells.
  EXPECT_LT(after, 0.75 * before);
}

TEST_P(LegSurfaceTest, LabelsAndLayersAreThoseOfBothObjects) {
  const auto one = leg();
  auto surface = leg_surface(*one, 0.5f, *engine);
  ASSERT_TRUE(surface.ok());
  const auto labels = leg_labels(*one, surface->state, surface->mesh.positions, *engine);
  ASSERT_TRUE(labels.ok());
  ASSERT_EQ(labels->size(), surface->mesh.positions.size());
  for (const std::uint32_t label : *labels) ASSERT_LT(label, 2u);
  const auto look = leg_look(*one, true, *surface, *engine);
  ASSERT_TRUE(look.ok());
  ASSERT_EQ(look->layers.size(), 2u);
  EXPECT_EQ(look->layers[0].object, one->from);
  EXPECT_EQ(look->layers[1].object, one->to);
  EXPECT_NEAR(look->layers[1].opacity, 0.5f, 0.1f);
}

TEST_P(LegSurfaceTest, ItsFieldIsZeroOnTheMeshAndPositiveInside) {
  const auto one = leg();
  for (const float time : {0.0f, 0.4f, 1.0f}) {
    const auto surface = leg_surface(*one, time, *engine);
    ASSERT_TRUE(surface.ok());
    const Mesh& mesh = surface->mesh;
    const auto field = [&](float offset) {
      std::vector<Vec3> points;
      for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        points.push_back(mesh.positions[i] + offset * mesh.normals[i]);
      auto values = surface_field(*one, *surface, points, *engine);
      EXPECT_TRUE(values.ok());
      return std::move(values).value();
    };
    const float cell = one->settings.cell;
    const std::vector<float> at = field(0), inside = field(-cell), outside = field(cell);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const float range = inside[i] - outside[i];
      if (inside[i] <= 0 || outside[i] >= 0 || std::abs(at[i]) > 0.05f * range) ++wrong;
    }
    // At edges, normals lead along the surface.
    EXPECT_LT(static_cast<double>(wrong), 0.01 * static_cast<double>(at.size())) << time;
  }
}

/// A source of many small parts, and a target of one: near the source its parts stay, and what
/// comes off later is a fragment.
TEST(MinComponentShare, IsOfTheObjectNearEitherEnd) {
  const auto engine = make_cpu_engine();
  Leg leg = *make_test_leg(Interpolation::kDistance, *engine);
  leg.settings.min_component_share = 1e-4f;
  PreparedObject from = *leg.from;
  from.distances.smallest_component_share = 0.004;
  leg.from = std::make_shared<const PreparedObject>(from);
  const float start = 0, near = 0.1f, on_the_way = 0.2f, half = 0.5f, end = 1;
  EXPECT_DOUBLE_EQ(min_component_share(leg, start), 0.002);
  EXPECT_DOUBLE_EQ(min_component_share(leg, near), 0.002);
  EXPECT_GT(min_component_share(leg, on_the_way), 0.002);
  EXPECT_DOUBLE_EQ(min_component_share(leg, half), 0.015);
  EXPECT_DOUBLE_EQ(min_component_share(leg, end), 0.015);
  // Parts that both have may meet.
  PreparedObject to = *leg.to;
  to.distances.smallest_component_share = 0.008;
  leg.to = std::make_shared<const PreparedObject>(to);
  EXPECT_DOUBLE_EQ(min_component_share(leg, half), 0.004);
  EXPECT_DOUBLE_EQ(min_component_share(leg, end), 0.004);
}

/// A ball of volume 1 beside `count` small ones of a hundredth each.
Mesh mesh_of_balls(Engine& engine, int count) {
  std::vector<Ball> balls{{{0, 0, 0}, 4, 4, {}}};
  for (int i = 0; i < count; ++i)
    balls.push_back(
        {{3.0f + static_cast<float>(i % 10), static_cast<float>(i / 10), 0}, 86, 4, {}});
  auto mesh = extract_surface(engine, balls, 0.1f, {});
  EXPECT_TRUE(mesh.ok());
  return std::move(mesh).value();
}

TEST(RemoveFragments, TakesAFewAndNoHeap) {
  const auto engine = make_cpu_engine();
  Leg leg = *make_test_leg(Interpolation::kDistance, *engine);
  leg.settings.min_component_share = 1e-4f;
  for (const int count : {3, 30}) {
    Mesh mesh = mesh_of_balls(*engine, count);
    const std::size_t before = mesh.positions.size();
    Mesh large = mesh;
    remove_small_components(large, 0.015);
    const double share = 1 - volume_of(large) / volume_of(mesh);
    remove_fragments(leg, 0.5f, mesh);
    EXPECT_GT(share, count == 3 ? 0.005 : 0.06);
    EXPECT_LT(share, count == 3 ? 0.05 : 0.5);
    EXPECT_EQ(mesh.positions.size() == before, count == 30) << count;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, LegSurfaceTest,
                         ::testing::Values(Interpolation::kBalls, Interpolation::kDistance),
                         [](const auto& kind) {
                           return kind.param == Interpolation::kBalls ? "Balls" : "Distances";
                         });

}  // namespace
}  // namespace polymorph
