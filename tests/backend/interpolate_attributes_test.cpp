// What balls carry to points, against the definition in double; and the same bits on every backend
// (parity_test.cpp).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "kernels/field_kinds.h"
#include "testing/backend.h"

namespace polymorph {
namespace {

/// What a ball adds at p, in double; 0 where it takes away.
double strength_at(const Ball& ball, FieldKind kind, Vec3 p) {
  const double d[3] = {to_double(p.x) - to_double(ball.center.x),
                       to_double(p.y) - to_double(ball.center.y),
                       to_double(p.z) - to_double(ball.center.z)};
  const Sym3& s = ball.shape;
  const double q = to_double(s.xx) * d[0] * d[0] + to_double(s.yy) * d[1] * d[1] +
                   to_double(s.zz) * d[2] * d[2] +
                   2 * (to_double(s.xy) * d[0] * d[1] + to_double(s.xz) * d[0] * d[2] +
                        to_double(s.yz) * d[1] * d[2]);
  const double w = to_double(ball.w);
  if (kind == FieldKind::kGaussian) return std::exp(w - to_double(ball.a) * q);
  if (kind == FieldKind::kInverseSquare) return std::max(w, 0.0) / q;
  const double u = to_double(ball.a) * q;
  return u < 1 ? std::max(w, 0.0) * (1 - u) * (1 - u) * (1 - 4.0 / 9 * u) : 0;
}

std::vector<BallAttribute> random_values(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  const auto unit = [&random] { return static_cast<float>(random() >> 8) * 0x1p-23f - 1; };
  std::vector<BallAttribute> out(count);
  for (BallAttribute& c : out)
    for (int k = 0; k < 4; ++k) c.value[k] = unit(), c.slope[k] = {unit(), unit(), unit()};
  return out;
}

std::vector<Vec3> points_around(FieldKind field, unsigned seed, float reach) {
  std::vector<Vec3> points;
  for (const Ball& ball : random_balls(700, field, seed)) points.push_back(ball.center * reach);
  return points;
}

/// Value k of ball e's carried quadruple at p.
double value_at(const BallAttribute& c, const Ball& ball, Vec3 p, int k) {
  const Vec3 slope = c.slope[k];
  return to_double(c.value[k]) + to_double(slope.x) * (to_double(p.x) - to_double(ball.center.x)) +
         to_double(slope.y) * (to_double(p.y) - to_double(ball.center.y)) +
         to_double(slope.z) * (to_double(p.z) - to_double(ball.center.z));
}

class SharesTest : public SurfaceTest {
 protected:
  std::vector<AttributeValues> interpolate_attributes(const std::vector<Ball>& balls,
                                                      const std::vector<BallAttribute>& carried,
                                                      const std::vector<Vec3>& points,
                                                      FieldKind field) {
    ExtractSettings settings;
    settings.field = field;
    std::vector<AttributeValues> values;
    const EngineStatus status = engine_->interpolate(balls, carried, points, settings, values);
    EXPECT_EQ(status.code, EngineCode::kOk) << status.message;
    return values;
  }

  void expect_definition(const std::vector<Ball>& balls, FieldKind field, int maps) {
    const std::vector<BallAttribute> carried =
        random_values(static_cast<std::size_t>(maps) * balls.size(), 3);
    const std::vector<Vec3> points = points_around(field, 12, 1.1f);
    const std::vector<AttributeValues> values =
        interpolate_attributes(balls, carried, points, field);
    ASSERT_EQ(values.size(), points.size() * static_cast<std::size_t>(maps));
    std::size_t reached = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::vector<double> strength;
      for (const Ball& ball : balls) strength.push_back(strength_at(ball, field, points[i]));
      const double strongest = *std::max_element(strength.begin(), strength.end());
      if (strongest < 1e-25) continue;
      ++reached;
      for (int k = 0; k < 4 * maps; ++k) {
        double sum = 0, whole = 0, largest = 0, doubtful = 0;
        for (std::size_t e = 0; e < balls.size(); ++e) {
          const BallAttribute& c =
              carried[e * static_cast<std::size_t>(maps) + static_cast<std::size_t>(k / 4)];
          const double value = value_at(c, balls[e], points[i], k % 4);
          largest = std::max(largest, std::abs(value));
          // Right at the limit rounding decides whether a ball counts.
          if (std::abs(strength[e] / (1e-4 * strongest) - 1) < 1e-3) doubtful += strength[e];
          if (!(strength[e] > 1e-4 * strongest)) continue;
          sum += strength[e] * value, whole += strength[e];
        }
        const auto at = i * static_cast<std::size_t>(maps) + static_cast<std::size_t>(k / 4);
        ASSERT_NEAR(to_double(values[at].v[k % 4]), sum / whole,
                    largest * (2e-5 + 2 * doubtful / whole))
            << i << " " << k;
      }
    }
    EXPECT_GT(reached, 300u);
  }
};

TEST_P(SharesTest, values_are_means_by_share_of_the_field) {
  for (const FieldKind field : kFieldKinds)
    for (const int maps : {1, 2}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(field) << " " << maps);
      const std::vector<Ball> balls = random_balls(80, field, 11);
      expect_definition(balls, field, maps);
      if (field == FieldKind::kInverseSquare) {
        expect_definition(with_holes(balls), field, maps);
      } else {
        expect_definition(squeezed(balls, 5), field, maps);
      }
    }
}

/// More balls matter than a run's list holds.
TEST_P(SharesTest, a_crowd_around_a_point_is_summed_whole) {
  const std::vector<Ball> balls = random_balls(2500, FieldKind::kInverseSquare, 2);
  expect_definition(balls, FieldKind::kInverseSquare, 1);
  std::vector<Ball> one_place = random_balls(2500, FieldKind::kGaussian, 2);
  for (Ball& ball : one_place) ball.center = ball.center * 0.1f;
  expect_definition(one_place, FieldKind::kGaussian, 1);
}

TEST_P(SharesTest, where_nothing_reaches_the_nearest_ball_decides) {
  const std::vector<Ball> balls = {{{0, 0, 0}, 1, 1, {}}, {{200, 0, 0}, 1, 1, {}}};
  std::vector<BallAttribute> carried(2);
  carried[0].value[0] = 3, carried[1].value[0] = 7, carried[1].slope[1] = {1, 0, 0};
  const std::vector<Vec3> points = {{0.1f, 0, 0}, {60, 0, 0}, {150, 0, 0}, {200, 0.2f, 0}};
  for (const FieldKind field : {FieldKind::kGaussian, FieldKind::kWyvill}) {
    const std::vector<AttributeValues> values =
        interpolate_attributes(balls, carried, points, field);
    EXPECT_FLOAT_EQ(values[0].v[0], 3);
    EXPECT_FLOAT_EQ(values[1].v[0], 3);
    EXPECT_FLOAT_EQ(values[2].v[0], 7);
    EXPECT_FLOAT_EQ(values[2].v[1], -50);
    EXPECT_FLOAT_EQ(values[3].v[0], 7);
  }
}

TEST_P(SharesTest, refuses_what_does_not_fit_the_balls) {
  const std::vector<Ball> balls = random_balls(3, FieldKind::kGaussian, 1);
  std::vector<AttributeValues> values(5);
  for (const std::size_t count : {0u, 2u, 4u, 9u}) {
    const EngineStatus status =
        engine_->interpolate(balls, std::vector<BallAttribute>(count), {Vec3{}}, {}, values);
    EXPECT_EQ(status.code, EngineCode::kBadInput) << count;
    EXPECT_NE(status.message.find("3 balls"), std::string::npos) << status.message;
    EXPECT_TRUE(values.empty());
  }
  EXPECT_EQ(engine_->interpolate(balls, std::vector<BallAttribute>(3), {}, {}, values).code,
            EngineCode::kOk);
  std::vector<Ball> bad = balls;
  bad[1].w = NAN;
  EXPECT_EQ(engine_->interpolate(bad, std::vector<BallAttribute>(3), {Vec3{}}, {}, values).code,
            EngineCode::kBadInput);
}

PM_EVERY_BACKEND(SharesTest);

}  // namespace
}  // namespace polymorph
