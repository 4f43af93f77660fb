#include "field/near_balls.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "kernels/engine.h"

namespace polymorph {
namespace {

std::vector<Ball> balls_for(FieldKind kind) {
  std::vector<Ball> balls;
  for (std::uint64_t i = 0; i < 60; ++i) {
    const auto r = [&](std::uint64_t k) { return random_float(7, k, i); };
    Ball ball{{2 * r(0) - 1, 2 * r(1) - 1, 2 * r(2) - 1}, 4 + 20 * r(3), 1 + 2 * r(4), {}};
    if (kind == FieldKind::kInverseSquare) ball.w = 0.01f + 0.02f * r(4);
    if (kind == FieldKind::kWyvill) ball.a = 1 + 3 * r(3);
    if (kind != FieldKind::kInverseSquare && i % 2)
      ball.shape = {4, 0.5f, 0.5f, 0, 0, 0};  // determinant 1
    balls.push_back(ball);
  }
  return balls;
}

std::vector<Vec3> random_points(std::uint64_t seed) {
  std::vector<Vec3> points;
  for (std::uint64_t i = 0; i < 300; ++i)
    points.push_back(
        {random_float(seed, 0, i), random_float(seed, 1, i), 2 * random_float(seed, 2, i) - 1});
  return points;
}

class NearBallsTest : public ::testing::TestWithParam<FieldKind> {};

TEST_P(NearBallsTest, SumsWhatTheKernelsSumAndItsGradientIsItsSlope) {
  const std::vector<Ball> balls = balls_for(GetParam());
  const NearBalls near(balls, GetParam());
  const std::vector<Vec3> points = random_points(1);
  ExtractSettings settings;
  settings.field = GetParam();
  settings.cutoff = 1e-9f;
  std::vector<float> values;
  ASSERT_EQ(make_cpu_engine()->sample(balls, points, settings, values).code, EngineCode::kOk);
  constexpr float kMaxDistance = 0.01f;
  for_each_near(near, points, kMaxDistance, [&](std::size_t begin, std::size_t end, auto list) {
    for (std::size_t i = begin; i < end; ++i) {
      const LogField field = near.log_field(points[i], list);
      EXPECT_NEAR(field.value, std::log(static_cast<double>(values[i])), 2e-3);
      const float h = 1e-3f;
      const auto slope = [&](Vec3 d) {
        return (near.log_field(points[i] + d * h, list).value -
                near.log_field(points[i] - d * h, list).value) /
               (2.0 * static_cast<double>(h));
      };
      const auto tolerance = 0.02 * static_cast<double>(length(field.gradient)) + 0.02;
      EXPECT_NEAR(static_cast<double>(field.gradient.x), slope({1, 0, 0}), tolerance);
      EXPECT_NEAR(static_cast<double>(field.gradient.y), slope({0, 1, 0}), tolerance);
      EXPECT_NEAR(static_cast<double>(field.gradient.z), slope({0, 0, 1}), tolerance);
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Kinds, NearBallsTest,
                         ::testing::Values(FieldKind::kGaussian, FieldKind::kInverseSquare,
                                           FieldKind::kWyvill));

TEST(NearBalls, LeavesOutFarBallsAndIsZeroWhereNoneReaches) {
  const std::vector<Ball> balls = {{{0, 0, 0}, 1, 2, {}}, {{100, 0, 0}, 1, 2, {}}};
  EXPECT_EQ(NearBalls(balls, FieldKind::kGaussian).within({{-1, -1, -1}, {1, 1, 1}}),
            std::vector<std::uint32_t>{0});
  const NearBalls soft(balls, FieldKind::kWyvill);
  const Box far{{40, 0, 0}, {41, 1, 1}};
  const LogField field = soft.log_field({40, 0, 0}, soft.within(far));
  EXPECT_EQ(field.value, -std::numeric_limits<double>::infinity());
  EXPECT_EQ(field.gradient, Vec3{});
}

}  // namespace
}  // namespace polymorph
