#include "analyze/facing_error.h"

#include <gtest/gtest.h>

#include <numbers>
#include <vector>

#include "testing/morph.h"

namespace polymorph {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

std::vector<Vec3d> figure() {
  std::vector<Vec3d> points;
  for (const Ball& ball : random_balls(30, 2)) points.emplace_back(ball.center);
  return points;
}

std::vector<Vec3d> sent(std::vector<Vec3d> points, const Mat3& turn, double scale) {
  for (Vec3d& p : points) p = turn * p * scale + Vec3d{3, -1, 2};
  return points;
}

TEST(TurnAboutVertical, IsThatOfATurnedAndScaledCopy) {
  const std::vector<Vec3d> from = figure();
  for (const double degrees : {-150.0, -40.0, 0.0, 90.0, 179.0}) {
    const Mat3 turn = exp_rotation({0, degrees * kDegree, 0});
    const std::vector<Vec3d> to = sent(from, turn, 2.5);
    EXPECT_NEAR(*rotation_about_vertical({from, to, {}}), degrees, 1e-9);
    EXPECT_NEAR(*rotation_about_vertical({from, to, {}}, turn), 0, 1e-9);
    EXPECT_NEAR(*rotation_about_vertical({from, to, {}}, exp_rotation({0, -30 * kDegree, 0})),
                degrees + 30 > 180 ? degrees - 330 : degrees + 30, 1e-9);
  }
}

TEST(TurnAboutVertical, HeavyPointsDecide) {
  // Four light points turn by 90 degrees, two heavy ones stay, all about the same middle.
  const std::vector<Vec3d> from{{1, 0, 0},  {-1, 0, 0}, {0, 0, 1},
                                {0, 0, -1}, {1, 5, 1},  {-1, 5, -1}};
  const std::vector<Vec3d> to{{0, 0, -1}, {0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {1, 5, 1}, {-1, 5, -1}};
  const std::vector<double> weights{1, 1, 1, 1, 1e6, 1e6};
  EXPECT_NEAR(*rotation_about_vertical({from, to, {}}), 45, 1e-9);
  EXPECT_NEAR(*rotation_about_vertical({from, to, weights}), 0, 1e-3);
}

TEST(TurnAboutVertical, IsNotKnownWhereEveryTurnIsAsGood) {
  const std::vector<Vec3d> pole{{1, 0, 1}, {1, 1, 1}, {1, 2, 1}};
  EXPECT_FALSE(rotation_about_vertical({pole, pole, {}}));
  EXPECT_FALSE(rotation_about_vertical({}));
  // Mirrored in x, a square has no turn.
  const std::vector<Vec3d> square{{1, 0, 0}, {0, 0, 1}, {-1, 0, 0}, {0, 0, -1}};
  const std::vector<Vec3d> mirrored{{-1, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 0, -1}};
  EXPECT_FALSE(rotation_about_vertical({square, mirrored, {}}));
}

}  // namespace
}  // namespace polymorph
