// Test fixture for every backend: a test written against SurfaceTest runs on the CPU and on a CUDA
// device. Balls and grids for such tests.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "kernels/engine.h"

namespace polymorph {

inline double to_double(float v) { return static_cast<double>(v); }

enum class Backend { kCpu, kCuda };

inline bool cuda_required() {
  const char* value = std::getenv("POLYMORPH_REQUIRE_CUDA");
  return value != nullptr && std::string(value) == "1";
}

inline std::unique_ptr<Engine> make_engine(Backend backend, EngineStatus& status) {
  status = {};
  return backend == Backend::kCpu ? make_cpu_engine() : make_cuda_engine(0, status);
}

/// Skips the calling test if `engine` is null, for the reason in `status`; fails it if a CUDA
/// device is required.
#define PM_SKIP_WITHOUT(engine, status)                                      \
  if ((engine) == nullptr) {                                                 \
    if (cuda_required()) FAIL() << "cuda is required: " << (status).message; \
    GTEST_SKIP() << (status).message;                                        \
  }                                                                          \
  static_assert(true, "")

class SurfaceTest : public testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    EngineStatus status;
    engine_ = make_engine(GetParam(), status);
    PM_SKIP_WITHOUT(engine_, status);
  }

  Mesh extract(const BallSet& balls, const Grid& grid, const ExtractSettings& settings = {}) {
    Mesh mesh;
    const EngineStatus status = engine_->extract(balls, grid, settings, mesh);
    EXPECT_EQ(status.code, EngineCode::kOk) << status.message;
    return mesh;
  }

  std::vector<float> sample(const BallSet& balls, const std::vector<Vec3>& points,
                            const ExtractSettings& settings = {}) {
    std::vector<float> values;
    const EngineStatus status = engine_->sample(balls, points, settings, values);
    EXPECT_EQ(status.code, EngineCode::kOk) << status.message;
    return values;
  }

  std::unique_ptr<Engine> engine_;
};

inline std::string backend_name(const testing::TestParamInfo<Backend>& info) {
  return info.param == Backend::kCpu ? "Cpu" : "Cuda";
}

#define PM_EVERY_BACKEND(suite)                                                            \
  INSTANTIATE_TEST_SUITE_P(Backend, suite, testing::Values(Backend::kCpu, Backend::kCuda), \
                           backend_name)

constexpr float kBlobbiness = 4.0f;

/// Returns a Gaussian ball whose surface, if it is the only ball, has this radius.
inline Ball gaussian_ball(Vec3 center, float radius) {
  return {center, kBlobbiness / (radius * radius), kBlobbiness};
}

/// Returns the grid of `points`^3 points over the cube with this centre and edges of 2 `half`.
inline Grid cube_grid(int points, float half, Vec3 center = {}) {
  return {center - Vec3{half, half, half},
          2 * half / static_cast<float>(points - 1),
          {points, points, points}};
}

/// Returns `count` balls with centres in [-1, 1]^3, the same for the same seed.
inline std::vector<Ball> random_balls(int count, FieldKind field, unsigned seed) {
  std::mt19937 random(seed);
  const auto unit = [&random] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  std::vector<Ball> balls;
  for (int i = 0; i < count; ++i) {
    const Vec3 center = {2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1};
    const float radius = 0.1f + 0.25f * unit();
    Ball ball = gaussian_ball(center, radius);
    if (field == FieldKind::kInverseSquare) ball.w = 0.2f * radius * radius;
    if (field == FieldKind::kWyvill) {
      ball.a = 1 / (4 * radius * radius);
      ball.w = 1.7f;
    }
    balls.push_back(ball);
  }
  return balls;
}

/// Negates the weight of every third ball, so that it lowers the field.
inline std::vector<Ball> with_holes(std::vector<Ball> balls) {
  for (std::size_t i = 2; i < balls.size(); i += 3) balls[i].w = -balls[i].w;
  return balls;
}

/// Returns Ball::shape of an ellipsoid whose half axes have these ratios, rotated about x and then
/// about z, radians.
inline Sym3 shape_of(Vec3 axes, double turn_z, double turn_x) {
  const double cz = std::cos(turn_z), sz = std::sin(turn_z);
  const double cx = std::cos(turn_x), sx = std::sin(turn_x);
  const double r[3][3] = {{cz, -sz * cx, sz * sx}, {sz, cz * cx, -cz * sx}, {0, sx, cx}};
  const double v = std::cbrt(static_cast<double>(axes.x) * static_cast<double>(axes.y) *
                             static_cast<double>(axes.z));
  const double h[3] = {static_cast<double>(axes.x) / v, static_cast<double>(axes.y) / v,
                       static_cast<double>(axes.z) / v};
  const auto entry = [&](int i, int j) {
    double sum = 0;
    for (int e = 0; e < 3; ++e) sum += r[i][e] * r[j][e] / (h[e] * h[e]);
    return static_cast<float>(sum);
  };
  return {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)};
}

/// Returns the balls as ellipsoids in random directions, whose axes differ by a factor of up to 4;
/// every fifth ball stays round.
inline std::vector<Ball> squeezed(std::vector<Ball> balls, unsigned seed) {
  std::mt19937 random(seed + 1000);
  const auto unit = [&random] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const Vec3 axes = {0.5f + 1.5f * unit(), 0.5f + 1.5f * unit(), 0.5f + 1.5f * unit()};
    const double turn_z = 6.28 * static_cast<double>(unit()),
                 turn_x = 6.28 * static_cast<double>(unit());
    if (i % 5 != 4) balls[i].shape = shape_of(axes, turn_z, turn_x);
  }
  return balls;
}

}  // namespace polymorph
