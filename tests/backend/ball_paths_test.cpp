// The balls' steps: powers and turns against libm, and on every backend the same balls, which stay
// where the surface is made.
#include "kernels/ball_paths.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "kernels/linear.h"
#include "testing/backend.h"
#include "testing/mesh.h"

namespace polymorph {
namespace {

TEST(Linear, powers_and_roots_are_those_of_libm) {
  for (double x = -30; x <= 30; x += 0.37) {
    EXPECT_NEAR(exp_scalar(x) / std::exp(x), 1, 1e-13) << x;
    const double v = std::exp(x);
    EXPECT_NEAR(cube_root(v) / std::cbrt(v), 1, 5e-16) << v;
  }
  EXPECT_EQ(exp_scalar(0), 1);
  EXPECT_EQ(cube_root(27), 3);
}

/// Rodrigues' formula with libm's sine and cosine.
Mat3 rotation(Vec3d axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), d = 1 - c;
  return {{c + d * axis.x * axis.x, d * axis.x * axis.y - s * axis.z,
           d * axis.x * axis.z + s * axis.y, d * axis.x * axis.y + s * axis.z,
           c + d * axis.y * axis.y, d * axis.y * axis.z - s * axis.x,
           d * axis.x * axis.z - s * axis.y, d * axis.y * axis.z + s * axis.x,
           c + d * axis.z * axis.z}};
}

TEST(Linear, turns_are_those_of_libm) {
  const Vec3d axis = normalized(Vec3d{1, -2, 0.5});
  for (double angle = 1e-9; angle < 8; angle = 1.3 * angle + 1e-3) {
    const Mat3 got = exp_rotation(axis * angle), wanted = rotation(axis, angle);
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(got.m[i], wanted.m[i], 2e-15) << angle;
  }
  for (int i = 0; i < 9; ++i) EXPECT_EQ(exp_rotation({}).m[i], Mat3{}.m[i]);
}

TEST(Linear, the_exponential_of_a_symmetric_matrix_is_that_of_its_eigenvalues) {
  const Mat3 turn = rotation(normalized(Vec3d{1, 2, 3}), 1.1);
  const double sets[][3] = {{0, 0, 0}, {1, -2, 1}, {9.2, -4.6, -4.6}, {1e-9, 0, -1e-9}};
  for (const auto& values : sets) {
    const Sym3d log = to_sym3d(turn * to_mat3(Sym3d{values[0], values[1], values[2], 0, 0, 0}) *
                               transposed(turn));
    const Mat3 got = to_mat3(exp_symmetric(log));
    const Mat3 wanted =
        turn *
        to_mat3(Sym3d{std::exp(values[0]), std::exp(values[1]), std::exp(values[2]), 0, 0, 0}) *
        transposed(turn);
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(got.m[i], wanted.m[i], 1e-13 * std::exp(values[0]));
  }
}

/// Balls that turn, grow, bow and drift, every third of them an ellipsoid.
std::shared_ptr<const BallPaths> some_paths(std::size_t count) {
  std::mt19937 random(9);
  const auto unit = [&random] { return static_cast<double>(random() >> 8) * 0x1p-23 - 1; };
  const auto vector = [&] { return Vec3d{unit(), unit(), unit()}; };
  auto paths = std::make_shared<BallPaths>();
  for (int i = 0; i < 3; ++i) paths->parts.push_back({vector(), vector(), vector() * 2, unit()});
  const std::vector<Ball> from = random_balls(static_cast<int>(count), FieldKind::kGaussian, 1),
                          to = squeezed(
                              random_balls(static_cast<int>(count), FieldKind::kGaussian, 2), 2);
  for (std::size_t e = 0; e < count; ++e) {
    BallPath path;
    path.start = from[e], path.end = to[e];
    path.from = vector(), path.to = vector(), path.bow = vector() * 0.1;
    path.launch = vector() * 3, path.drift = vector() * 0.2;
    path.from_volume = 1 + 0.5 * unit(), path.to_volume = 1 + 0.5 * unit();
    path.part = static_cast<std::uint32_t>(e % 3);
    path.round = e % 3 != 0;
    path.from_log = {unit(), unit(), 0, unit(), unit(), unit()};
    path.to_log = {unit(), 0, unit(), unit(), unit(), unit()};
    paths->balls.push_back(path);
  }
  return paths;
}

std::vector<MotionState> some_moments() {
  std::vector<MotionState> moments;
  for (const float time : {0.0f, 0.3f, 0.75f, 1.0f}) {
    MotionState moment;
    moment.time = moment.eased = time;
    moment.softness = 0.4;
    moment.drifted = 0.1;
    moments.push_back(moment);
    moment.thrown = true;
    moment.gravity = 8;
    moment.floor = -0.5;
    moments.push_back(moment);
  }
  return moments;
}

bool same_balls(const BallSet& a, const BallSet& b) {
  return a.size() == b.size() &&
         std::memcmp(a.balls().data(), b.balls().data(), a.size() * sizeof(Ball)) == 0;
}

class MotionTest : public SurfaceTest {
 protected:
  BallSet step(const std::shared_ptr<const BallPaths>& paths, const MotionState& moment,
               const std::vector<float>& own = {}) {
    BallSet balls;
    const EngineStatus status = engine_->move_balls(paths, moment, own, balls);
    EXPECT_EQ(status.code, EngineCode::kOk) << status.message;
    return balls;
  }
};

/// The functor itself, one ball after the other, on this machine.
std::vector<Ball> stepped_here(const BallPaths& paths, const MotionState& moment,
                               const std::vector<float>& own) {
  const std::vector<PartPose> places = part_poses_at(paths.parts, moment.eased);
  std::vector<Ball> balls(paths.balls.size());
  const auto size = [](const auto& of) { return static_cast<std::int64_t>(of.size()); };
  const MoveBalls step = {{paths.balls.data(), size(paths.balls)},
                          {paths.parts.data(), size(paths.parts)},
                          {places.data(), size(places)},
                          {own.data(), size(own)},
                          moment,
                          {balls.data(), size(balls)}};
  for (std::int64_t e = 0; e < size(balls); ++e) step(e);
  return balls;
}

TEST_P(MotionTest, every_backend_steps_to_the_same_bits) {
  const auto paths = some_paths(1000);
  std::vector<float> own;
  for (std::size_t e = 0; e < 1000; ++e) own.push_back(static_cast<float>(e % 11) * 0.1f);
  for (const MotionState& moment : some_moments()) {
    EXPECT_TRUE(same_balls(step(paths, moment), stepped_here(*paths, moment, {})));
    EXPECT_TRUE(same_balls(step(paths, moment, own), stepped_here(*paths, moment, own)));
  }
}

TEST_P(MotionTest, ends_are_the_balls_themselves_and_sizes_go_between) {
  auto paths = std::make_shared<BallPaths>(*some_paths(50));
  for (BallPath& path : paths->balls) path.drift = {};
  MotionState moment;
  const BallSet first = step(paths, moment);
  moment.time = moment.eased = 1;
  const BallSet last = step(paths, moment);
  moment.time = moment.eased = 0.5f;
  const BallSet middle = step(paths, moment);
  for (std::size_t e = 0; e < 50; ++e) {
    const BallPath& path = paths->balls[e];
    EXPECT_TRUE(same_balls({first[e]}, {path.start}));
    EXPECT_TRUE(same_balls({last[e]}, {path.end}));
    const double volume = 0.5 * (path.from_volume + path.to_volume);
    EXPECT_NEAR(middle[e].a * std::pow(volume, 2.0 / 3), 1, 1e-5);
    EXPECT_FLOAT_EQ(middle[e].w, 0.5f * (path.start.w + path.end.w));
    EXPECT_EQ(is_round(middle[e]), path.round);
  }
}

/// The balls stay where the surface is made, and are not mistaken for others.
TEST_P(MotionTest, a_surface_is_that_of_the_balls_given) {
  const auto paths = some_paths(60);
  const auto fresh = make_cpu_engine();
  const Grid grid = cube_grid(60, 4);
  const auto expect_own_surface = [&](const BallSet& balls) {
    Mesh wanted;
    ASSERT_EQ(fresh->extract(balls, grid, {}, wanted).code, EngineCode::kOk);
    ASSERT_FALSE(wanted.triangles.empty());
    expect_same_mesh(extract(balls, grid), wanted);
  };
  MotionState moment;
  moment.time = moment.eased = 0.3f;
  const BallSet balls = step(paths, moment);
  expect_own_surface(balls);
  std::vector<Ball> changed = balls.balls();
  changed[7].center.x += 0.25f;
  const BallSet others_of_that_size = changed;
  expect_own_surface(others_of_that_size);
  expect_own_surface(balls);
  const BallSet moved = step(paths, moment);
  expect_own_surface(others_of_that_size);
  expect_own_surface(moved);
  changed.resize(50);
  expect_own_surface(changed);
  const auto others = some_paths(30);
  EXPECT_EQ(step(others, moment).size(), 30u);
  EXPECT_TRUE(same_balls(step(paths, moment), moved));
}

TEST_P(MotionTest, refuses_what_does_not_fit_the_paths) {
  const auto paths = some_paths(5);
  BallSet balls;
  EXPECT_EQ(engine_->move_balls(paths, {}, {0.5f, 0.5f}, balls).code, EngineCode::kBadInput);
  BallPaths wrong = *paths;
  wrong.balls[3].part = 3;
  const EngineStatus status =
      engine_->move_balls(std::make_shared<const BallPaths>(wrong), {}, {}, balls);
  EXPECT_EQ(status.code, EngineCode::kBadInput);
  EXPECT_NE(status.message.find("part 3 of 3"), std::string::npos) << status.message;
  EXPECT_EQ(engine_->move_balls(std::make_shared<const BallPaths>(), {}, {}, balls).code,
            EngineCode::kOk);
  EXPECT_TRUE(balls.empty());
}

PM_EVERY_BACKEND(MotionTest);

}  // namespace
}  // namespace polymorph
