#include "spheres/carry_balls.h"

#include <gtest/gtest.h>

#include <ctime>

#include "model/shapes.h"
#include "spheres/quality.h"
#include "spheres/spheres.h"
#include "testing/model.h"
#include "testing/morph.h"

namespace polymorph {
namespace {

std::vector<Ball> some_balls() {
  std::vector<Ball> balls{ball_at({0, 1, 0}, 0.5f), ball_at({0.6f, 1.2f, 0.1f}, 0.3f)};
  balls[1].shape = {2, 1, 0.5f, 0, 0, 0};
  return balls;
}

TEST(CarryBalls, TheyTurnGrowAndShiftWithTheWhole) {
  const Model sphere = *make_shape("sphere");
  const std::vector<Ball> balls = some_balls();
  const Mat3 turn = exp_rotation({0.3, 1.1, -0.4});
  std::vector<Vec3> posed;
  for (const Vec3 p : sphere.points)
    posed.push_back(to_float(turn * Vec3d(p) * 1.5 + Vec3d{3, -1, 2}));
  const CarriedBalls carried = carry_balls(sphere, balls, bind_balls(sphere, balls), posed);
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const Ball whole = moved(balls[i], turn, 1.5, {3, -1, 2});
    EXPECT_LT(length(carried.balls[i].center - whole.center), 1e-5f);
    EXPECT_NEAR(carried.balls[i].a, whole.a, 1e-4f * whole.a);
    EXPECT_NEAR(carried.balls[i].shape.xy, whole.shape.xy, 1e-5f);
    EXPECT_EQ(carried.balls[i].w, balls[i].w);
    EXPECT_LT(rotation_angle(carried.rotations[i] * transposed(turn)), 1e-5);
  }
}

TEST(CarryBalls, APartThatPassesByDoesNotPull) {
  // Two bars side by side, nearer to each other than they are thick; the second one moves.
  Model bars = box_model({0, 0, 0}, {4, 1, 1});
  const std::size_t first = bars.points.size();
  add_box(bars, {0, 1.1f, 0}, {4, 2.1f, 1});
  const std::vector<Ball> balls{ball_at({1, 0.5f, 0.5f}, 0.5f), ball_at({1, 1.6f, 0.5f}, 0.5f)};
  std::vector<Vec3> posed = bars.points;
  for (std::size_t i = first; i < posed.size(); ++i) posed[i].x += 2;
  const CarriedBalls carried = carry_balls(bars, balls, bind_balls(bars, balls), posed);
  EXPECT_LT(length(carried.balls[0].center - balls[0].center), 1e-5f);
  EXPECT_LT(length(carried.balls[1].center - (balls[1].center + Vec3{2, 0, 0})), 1e-5f);
}

TEST(Refit, EachBallStaysTheOneThatItIs) {
  Model torus = *make_shape("torus");
  SphereSettings settings;
  settings.balls = 16;
  settings.coarse = true;
  const auto fitted = approximate(torus, settings);
  ASSERT_TRUE(fitted.ok());
  const Vec3 shift{0.04f, 0.02f, -0.03f};
  for (Vec3& p : torus.points) p = p + shift;
  const auto refitted = refit(torus, settings, fitted->balls);
  ASSERT_TRUE(refitted.ok());
  ASSERT_EQ(refitted->size(), fitted->balls.size());
  // The balls may slide along the ring, but stay on it, each next to where it was.
  for (std::size_t i = 0; i < refitted->size(); ++i)
    EXPECT_LT(length((*refitted)[i].center - fitted->balls[i].center - shift), 0.1f) << i;
  const auto figures = measure_quality(torus, InsideTest(torus), *refitted, FieldKind::kGaussian,
                                       {64, 5e4}),
             before = measure_quality(torus, InsideTest(torus), fitted->balls, FieldKind::kGaussian,
                                      {64, 5e4});
  ASSERT_TRUE(figures.ok() && before.ok());
  EXPECT_LT(1 - figures->iou, 0.6 * (1 - before->iou));
}

TEST(Refit, ItCostsAFourthOfAFitAtMost) {
  const Model torus = *make_shape("torus");
  SphereSettings settings;
  settings.balls = 48;
  // Of the processor, so that other programs do not count.
  const auto seconds = [](const auto& work) {
    const std::clock_t start = std::clock();
    work();
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  };
  std::vector<Ball> balls;
  const double cold = seconds([&] { balls = approximate(torus, settings)->balls; });
  const double warm = seconds([&] { balls = *refit(torus, settings, balls); });
  EXPECT_LT(warm, 0.25 * cold) << warm << " s and " << cold << " s";
}

}  // namespace
}  // namespace polymorph
