#include "morph/limbs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "base/random.h"
#include "model/load/load_model.h"
#include "spheres/spheres.h"
#include "testing/figure.h"
#include "testing/paths.h"

namespace polymorph {
namespace {

/// The limb whose tip is nearest to a place, and how far away that is.
std::pair<std::size_t, double> limb_at(const Limbs& limbs, Vec3d place) {
  std::pair<std::size_t, double> best{0, 1e9};
  for (std::size_t i = 0; i < limbs.limbs.size(); ++i)
    if (const double away = length(limbs.limbs[i].tip() - place); away < best.second)
      best = {i, away};
  return best;
}

TEST(Limbs, OfAFigureAreItsHeadArmsAndLegs) {
  const std::vector<Ball> balls = figure();
  const Limbs limbs = find_limbs(balls);
  ASSERT_EQ(limbs.limbs.size(), 5u);
  EXPECT_LT(length(limbs.center - Vec3d{0, 1.2, 0}), 0.4);
  const Vec3d tips[] = {
      {0, 2.3, 0}, {-1.1, 1.5, 0}, {1.1, 1.5, 0}, {-0.2, 0.05, 0.1}, {0.2, 0.05, 0.1}};
  std::vector<std::size_t> found;
  for (const Vec3d tip : tips) {
    const auto [limb, away] = limb_at(limbs, tip);
    EXPECT_LT(away, 0.15);
    found.push_back(limb);
  }
  std::sort(found.begin(), found.end());
  EXPECT_EQ(std::unique(found.begin(), found.end()), found.end());
  const Limb& arm = limbs.limbs[limb_at(limbs, tips[1]).first];
  EXPECT_NEAR(arm.length(), 0.85, 0.2);
  EXPECT_NEAR(arm.radius[3], 0.1, 0.04);
  EXPECT_TRUE(arm.nested.empty());
  EXPECT_NEAR(arm.stretch, arm.length(), 1e-9);
  for (std::size_t k = 1; k < kLimbStations; ++k) EXPECT_LT(arm.line[k].x, arm.line[k - 1].x);
  const Limb& head = limbs.limbs[limb_at(limbs, tips[0]).first];
  EXPECT_GT(head.volume, arm.volume);
}

TEST(Limbs, BallsBelongToTheirs) {
  const std::vector<Ball> balls = figure();
  const Limbs limbs = find_limbs(balls);
  const auto left = static_cast<std::uint32_t>(limb_at(limbs, {-1.1, 1.5, 0}).first);
  for (std::size_t b = 0; b < balls.size(); ++b) {
    const Vec3 p = balls[b].center;
    if (p.x < -0.45f || p.x > -0.15f) {
      EXPECT_EQ(limbs.holds(left, b), p.x < 0);
    }
    EXPECT_GE(limbs.ball_distances[b], 0.95 * length(Vec3d(p) - limbs.center) - 0.05);
  }
}

TEST(Limbs, ThatSitOnAnotherAreItsInnerOnes) {
  std::vector<Ball> balls = figure();
  // Two long fingers on the left hand.
  for (const float up : {-1.0f, 1.0f})
    for (int i = 1; i <= 8; ++i) {
      const float t = 0.07f * static_cast<float>(i);
      balls.push_back(ball_at({-1.1f - t, 1.5f + up * t, 0}, 0.08f));
    }
  const Limbs limbs = find_limbs(balls);
  const auto outer = std::find_if(limbs.limbs.begin(), limbs.limbs.end(),
                                  [](const Limb& limb) { return !limb.nested.empty(); });
  ASSERT_NE(outer, limbs.limbs.end());
  EXPECT_EQ(outer->nested.size(), 2u);
  EXPECT_NEAR(outer->root.x, -0.4, 0.2);
  EXPECT_LT(outer->stretch, outer->length());
  for (const std::uint32_t i : outer->nested) EXPECT_LT(limbs.limbs[i].root.x, -0.9);
}

TEST(Limbs, OfABallAreNone) {
  EXPECT_LT(find_limbs({ball_at({0, 0, 0}, 1)}).limbs.size(), 3u);
  EXPECT_TRUE(find_limbs({{{0, 0, 0}, 1, -1}}).limbs.empty());
}

TEST(Limbs, DoNotDependOnWhereTheObjectStandsOrOnItsSize) {
  const Limbs limbs = find_limbs(figure()), other = find_limbs(moved(figure(), {}, 10, {3, -2, 5}));
  ASSERT_EQ(limbs.limbs.size(), other.limbs.size());
  EXPECT_NEAR(other.mean_distance, 10 * limbs.mean_distance, 0.3 * limbs.mean_distance);
  for (const Limb& limb : limbs.limbs)
    EXPECT_LT(limb_at(other, limb.tip() * 10 + Vec3d{3, -2, 5}).second, 0.5);
}

TEST(Limbs, AreTheSameToTheBitEveryTime) {
  const std::vector<Ball> balls = random_balls(200, 7);
  const Limbs first = find_limbs(balls), second = find_limbs(balls);
  ASSERT_EQ(first.limbs.size(), second.limbs.size());
  for (std::size_t i = 0; i < first.limbs.size(); ++i) {
    EXPECT_EQ(std::memcmp(&first.limbs[i].line, &second.limbs[i].line, sizeof(Limb::line)), 0);
    EXPECT_EQ(first.limbs[i].volume, second.limbs[i].volume);
  }
  EXPECT_EQ(first.ball_limbs, second.ball_limbs);
  EXPECT_EQ(first.ball_distances, second.ball_distances);
  EXPECT_EQ(first.tip_distances, second.tip_distances);
}

TEST(Limbs, OfModelsAreWhatPeopleSee) {
  const auto limbs_of = [](const char* name) {
    const auto loaded = load_model(source_dir() / "scenes/models" / name, {});
    EXPECT_TRUE(loaded.ok());
    SphereSettings settings;
    settings.balls = 128;
    settings.coarse = true;
    const auto fitted = approximate_cached(loaded->model, settings, shared_cache());
    EXPECT_TRUE(fitted.ok());
    return find_limbs(fitted->balls);
  };
  EXPECT_EQ(limbs_of("humanoid.obj").limbs.size(), 5u);
  // Eight legs at least; torus and sphere have nothing that sticks out.
  EXPECT_GE(limbs_of("spider.obj").limbs.size(), 8u);
  EXPECT_LT(limbs_of("torus.obj").limbs.size(), 3u);
}

}  // namespace
}  // namespace polymorph
