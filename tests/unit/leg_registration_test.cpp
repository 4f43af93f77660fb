// Registration of a leg's map, and contact with the floor.
#include "leg/registration.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "leg/distance_leg.h"
#include "leg/leg_surface.h"
#include "mesh/sample_surface.h"
#include "morph/motion.h"
#include "testing/leg.h"

namespace polymorph {
namespace {

/// A test object with 64 balls: a map by few flattens everything.
std::shared_ptr<const PreparedObject> make_full_object(const std::string& shape, Vec3 place,
                                                       Engine& engine) {
  PreparedObject object = *make_test_object(shape, place, 0, engine);
  const Box box = object.model.box();
  object.balls.clear();
  for (int i = 0; i < 64; ++i) {
    const auto along = [](int k) { return (static_cast<float>(k) - 1.5f) / 4; };
    const Vec3 offset = {along(i % 4) * box.size().x, along(i / 4 % 4) * box.size().y,
                         along(i / 16) * box.size().z};
    const float radius = 0.15f * box.size().x;
    object.balls.push_back({box.center() + offset, 4 / (radius * radius), 4, {}});
  }
  return std::make_shared<const PreparedObject>(std::move(object));
}

/// The leg between two objects that is made of distances.
std::shared_ptr<const Leg> make_leg_between(std::shared_ptr<const PreparedObject> from,
                                            std::shared_ptr<const PreparedObject> to,
                                            const LegSettings& settings, Engine& engine) {
  PlanSide from_side, to_side;
  from_side.balls = from->balls;
  to_side.balls = to->balls;
  LegTiming timing;
  timing.interpolation = Interpolation::kDistance;
  LegParts parts{std::move(from), std::move(to), {}, {}};
  parts.plan = plan_morph(from_side, to_side, FieldKind::kGaussian, {}, timing.motion);
  const auto leg = make_leg(std::move(parts), timing, settings, engine, {});
  EXPECT_TRUE(leg.ok());
  return *leg;
}

std::shared_ptr<const Leg> make_full_leg(Engine& engine) {
  return make_leg_between(make_full_object("cube", {}, engine),
                          make_full_object("sphere", {0.4f, 0, 0}, engine), test_leg_settings(),
                          engine);
}

/// Mean distance from the target of points of the source that the map carries there.
double mean_miss(const Leg& leg, Engine& engine) {
  std::vector<Vec3> points;
  for (const SurfaceSample& sample : sample_surface(leg.from->model, 500))
    points.push_back(sample.point);
  const BallSet balls(balls_at(leg.plan, 0));
  const auto places = pull_back(distance_map(leg, 0, balls), points, engine);
  EXPECT_TRUE(places.ok());
  double sum = 0;
  for (const Vec3 place : places->target)
    sum += static_cast<double>(leg.to->closest->closest(place).distance);
  return sum / static_cast<double>(points.size());
}

TEST(Registration, PointsOfTheSurfaceArriveOnTheOther) {
  const auto engine = make_cpu_engine();
  const auto leg = make_full_leg(*engine);
  ASSERT_EQ(leg->plan.to_offsets.size(), leg->plan.pairs.size());
  Leg plain = *leg;
  plain.plan.from_offsets.clear(), plain.plan.to_offsets.clear();
  EXPECT_LT(mean_miss(*leg, *engine), 0.9 * mean_miss(plain, *engine));
  const auto again = register_surfaces(plain, *engine);
  ASSERT_TRUE(again.ok());
  EXPECT_TRUE(again->to_offsets == leg->plan.to_offsets);
}

TEST(Registration, EndsStayExact) {
  const auto engine = make_cpu_engine();
  const auto leg = make_full_leg(*engine);
  for (const float time : {0.0f, 1.0f}) {
    const BallSet balls(balls_at(leg->plan, time));
    std::vector<Vec3> points;
    for (const Ball& ball : balls.balls()) points.push_back(ball.center);
    const auto places = pull_back(distance_map(*leg, time, balls), points, *engine);
    ASSERT_TRUE(places.ok());
    const std::vector<Vec3>& own = time <= 0 ? places->source : places->target;
    for (std::size_t i = 0; i < points.size(); ++i) EXPECT_LT(length(own[i] - points[i]), 1e-5f);
  }
}

TEST(Registration, NothingIsDrawnWhereNormalsDisagree) {
  // Each of the cube's corners goes to the opposite one of the sphere: the map turns it inside out.
  const auto engine = make_cpu_engine();
  Leg leg = *make_full_leg(*engine);
  leg.plan.from_offsets.clear(), leg.plan.to_offsets.clear();
  for (Pair& pair : leg.plan.pairs)
    pair.to = static_cast<std::uint32_t>(leg.plan.to.size() - 1 - pair.from);
  leg.plan.alignment.rotation = {};
  leg.plan.alignment.rotation_vector = {};
  leg.plan.motion.path = Path::kStraight;
  set_paths(leg.plan);
  const auto registration = register_surfaces(leg, *engine);
  ASSERT_TRUE(registration.ok());
  for (const Vec3 offset : registration->to_offsets) EXPECT_EQ(offset, Vec3{});
}

TEST(Contact, WhatStandsAtBothEndsStandsInBetween) {
  const auto engine = make_cpu_engine();
  const auto height = [&](bool contact) {
    const auto cube = make_test_object("cube", {}, 0, *engine);
    // The torus is flatter: it is put where it stands as low as the cube.
    const float fall =
        make_test_object("torus", {}, 1, *engine)->model.box().low.y - cube->model.box().low.y;
    LegSettings settings = test_leg_settings();
    settings.contact = contact;
    const auto leg = make_leg_between(cube, make_test_object("torus", {0, -fall, 0}, 1, *engine),
                                      settings, *engine);
    EXPECT_EQ(leg->plan.lifts.empty(), !contact);
    float farthest = 0;
    for (const float time : {0.2f, 0.4f, 0.5f, 0.6f, 0.8f}) {
      const auto surface = leg_surface(*leg, time, *engine);
      EXPECT_TRUE(surface.ok());
      float low = surface->mesh.positions[0].y;
      for (const Vec3 p : surface->mesh.positions) low = std::min(low, p.y);
      farthest = std::max(farthest, std::abs(low - leg->from->model.box().low.y));
    }
    return farthest;
  };
  const float standing = height(true), free = height(false);
  EXPECT_LT(standing, 0.02f);  // of a height of 1, on cells of 0.05
  EXPECT_LT(standing, 0.5f * free);
}

}  // namespace
}  // namespace polymorph
