#include "morph/mass.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "base/exact_math.h"
#include "base/matrix_decompositions.h"
#include "base/parallel.h"
#include "base/random.h"
#include "kernels/field_kinds.h"
#include "kernels/linear.h"
#include "kernels/simd_math.h"

namespace polymorph {
namespace {

/// Evenly distributed points in the unit ball, in antipodal pairs: the R3 sequence (Roberts 2018),
/// mapped so that volumes are kept.
std::vector<Vec3> points_in_ball(std::size_t count) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; points.size() < count; ++i) {
    const auto [r0, r1, r2] = r3_point(i);
    const double radius = cube_root(r0), z = 2 * r1 - 1,
                 azimuth = 6.283185307179586 * r2;  // 2 pi r2
    const double horizontal = std::sqrt(std::max(0.0, 1 - z * z));
    const Vec3d p =
        Vec3d{horizontal * exact::cos(azimuth), horizontal * exact::sin(azimuth), z} * radius;
    points.push_back(to_float(p));
    points.push_back(to_float(p * -1.0));
  }
  return points;
}

/// A ball exp(w - q) is sampled out to q = max(w, 0) + 4, where its value is at most exp(-4).
constexpr float kTail = 4;
/// A ball is ignored at points where its value is below exp(-9), as in the kernels.
constexpr float kCutoff = 9;

/// The largest q at which a ball is sampled.
float max_q(const Ball& ball, float margin) { return std::max(ball.w, 0.0f) + margin; }

/// The longest semi-axis of d^T shape d = 1.
float longest_axis(const Ball& ball) {
  if (is_round(ball)) return 1;
  return static_cast<float>(
      1 / std::sqrt(std::max(principal_axes(to_mat3(ball.shape)).values[2], 1e-6)));
}

/// The map from the unit ball to the ellipsoid d^T shape d = 1.
Mat3 to_ellipsoid(const Ball& ball) {
  if (is_round(ball)) return {};
  return to_mat3(exp_symmetric(to_sym3d(log_symmetric(to_mat3(ball.shape))) * -0.5));
}

/// Integrals over a ball's share of the volume inside the surface: 1, and the squared distance from
/// a given centre.
struct VolumeIntegrals {
  double volume = 0, squared_distance = 0;
};

/// Integrates over ball `index` of a Gaussian field, at `points` in the unit ball, which are mapped
/// to the ball's ellipsoid.
VolumeIntegrals integrate_ball(const std::vector<Ball>& balls, std::size_t index,
                               const std::vector<float>& longest_axes,
                               const std::vector<Vec3>& points, Vec3d center) {
  const Ball& ball = balls[index];
  const float radius = std::sqrt(max_q(ball, kTail) / ball.a);
  std::vector<std::uint32_t> near_indices;
  for (std::uint32_t j = 0; j < balls.size(); ++j) {
    const float other_radius =
        std::sqrt(std::max(balls[j].w + kCutoff, 0.0f) / balls[j].a) * longest_axes[j];
    const float max_distance = other_radius + radius * longest_axes[index];
    const Vec3 d = balls[j].center - ball.center;
    if (dot(d, d) < max_distance * max_distance) near_indices.push_back(j);
  }
  const Mat3 ellipsoid = to_ellipsoid(ball);
  const auto value = [](const Ball& b, Vec3 x) {
    constexpr float kLog2E = 1.44269504f, kMin = -120;  // kMin is within exp2()'s range
    const float exponent = kLog2E * (b.w - b.a * quadratic(b.shape, x - b.center));
    return exp2(exponent > kMin ? exponent : kMin);
  };
  std::vector<Ball> near_balls;
  for (const std::uint32_t j : near_indices) near_balls.push_back(balls[j]);
  std::vector<float> values(near_balls.size());
  VolumeIntegrals sum;
  for (const Vec3& point : points) {
    const Vec3 x = ball.center + to_float(ellipsoid * (Vec3d(point) * static_cast<double>(radius)));
    // Values and sum have separate loops, because the compiler vectorizes only the first.
    for (std::size_t j = 0; j < near_balls.size(); ++j) values[j] = value(near_balls[j], x);
    const float field = std::accumulate(values.begin(), values.end(), 0.0f);
    if (!(field > 1)) continue;
    const auto share = static_cast<double>(value(ball, x) / field);
    const Vec3d offset = Vec3d(x) - center;
    sum.volume += share;
    sum.squared_distance += share * dot(offset, offset);
  }
  constexpr double kUnitBall = 4.18879020478639;  // volume, 4/3 pi
  const auto r = static_cast<double>(radius);
  const double count = static_cast<double>(points.size());
  return {kUnitBall * r * r * r * sum.volume / count,
          kUnitBall * r * r * r * sum.squared_distance / count};
}

/// The integrals in a Gaussian field, where balls share the volume in which they overlap.
std::vector<VolumeIntegrals> integrate_blended(const std::vector<Ball>& balls, Vec3d center) {
  // Some 65 000 points in total. If there are many balls, neighbours are alike and each needs fewer
  // points.
  const std::vector<Vec3> points =
      points_in_ball(std::clamp<std::size_t>(65536 / balls.size(), 8, 1024));
  std::vector<float> longest_axes(balls.size());
  for (std::size_t i = 0; i < balls.size(); ++i) longest_axes[i] = longest_axis(balls[i]);
  std::vector<VolumeIntegrals> integrals(balls.size());
  parallel_for(static_cast<std::int64_t>(balls.size()), [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    integrals[k] = integrate_ball(balls, k, longest_axes, points, center);
  });
  return integrals;
}

/// The integrals of balls taken alone, as if they did not overlap.
std::vector<VolumeIntegrals> integrate_separate(const std::vector<Ball>& balls, FieldKind kind,
                                                Vec3d center) {
  std::vector<VolumeIntegrals> integrals;
  for (const Ball& ball : balls) {
    const auto r = static_cast<double>(visit(kind, [&](auto field) { return field.radius(ball); }));
    const Vec3d offset = Vec3d(ball.center) - center;
    const double volume = r * r * r;  // in unit balls
    // A ball's mean squared distance from its own centre is 0.6 r^2.
    integrals.push_back({volume, volume * (dot(offset, offset) + 0.6 * r * r)});
  }
  return integrals;
}

std::vector<VolumeIntegrals> integrate_balls(const std::vector<Ball>& balls, FieldKind kind,
                                             Vec3d center) {
  return visit(kind, [](auto field) { return decltype(field)::kExponential; })
             ? integrate_blended(balls, center)
             : integrate_separate(balls, kind, center);
}

}  // namespace

std::vector<double> ball_masses(const std::vector<Ball>& balls, FieldKind kind) {
  std::vector<double> masses;
  for (const VolumeIntegrals& ball : integrate_balls(balls, kind, /*center=*/{}))
    masses.push_back(ball.volume);
  const double sum = std::accumulate(masses.begin(), masses.end(), 0.0);
  const auto count = static_cast<double>(balls.size());
  // Without a surface there is no volume to share.
  if (!(sum > 0)) return std::vector<double>(balls.size(), 1 / count);
  for (double& mass : masses) mass = std::max(mass / sum, 1e-4 / count);
  const double floored_sum = std::accumulate(masses.begin(), masses.end(), 0.0);
  for (double& mass : masses) mass /= floored_sum;
  return masses;
}

double radius_of_gyration(const std::vector<Ball>& balls, FieldKind kind, Vec3d center) {
  VolumeIntegrals sum;
  for (const VolumeIntegrals& ball : integrate_balls(balls, kind, center)) {
    sum.volume += ball.volume;
    sum.squared_distance += ball.squared_distance;
  }
  return sum.squared_distance > 0 ? std::sqrt(sum.squared_distance / sum.volume) : 1;
}

}  // namespace polymorph
