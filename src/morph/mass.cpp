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

/// Points spread evenly through the unit ball, each with its mirror image: the R3 sequence
/// (Roberts 2018) mapped by volume.
std::vector<Vec3> points_in_ball(std::size_t count) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; points.size() < count; ++i) {
    const auto [r0, r1, r2] = r3_point(i);
    const double radius = cube_root(r0), z = 2 * r1 - 1, turn = 6.283185307179586 * r2;
    const double side = std::sqrt(std::max(0.0, 1 - z * z));
    const Vec3d p = Vec3d{side * exact::cos(turn), side * exact::sin(turn), z} * radius;
    points.push_back(to_float(p));
    points.push_back(to_float(p * -1.0));
  }
  return points;
}

/// The reach of a ball beyond its surface's level, in its exponent: exp(-4) of the field.
constexpr float kTail = 4;
/// The exponent from which a ball's part in the others' points is dropped, as kernels do.
constexpr float kCutoff = 9;

float exponent_reach(const Ball& ball, float more) { return std::max(ball.w, 0.0f) + more; }

float widest_axis(const Ball& ball) {
  if (is_round(ball)) return 1;
  return static_cast<float>(
      1 / std::sqrt(std::max(principal_axes(to_mat3(ball.shape)).values[2], 1e-6)));
}

/// Unit ball -> the ellipsoid d^T shape d = 1.
Mat3 to_ellipsoid(const Ball& ball) {
  if (is_round(ball)) return {};
  return to_mat3(exp_symmetric(to_sym3d(log_symmetric(to_mat3(ball.shape))) * -0.5));
}

/// A ball's part of what lies inside the surface: its volume, and the integral of the squared
/// distance from a point.
struct Part {
  double volume = 0, squares = 0;
};

Part part_inside(const std::vector<Ball>& balls, std::size_t index,
                 const std::vector<float>& widest, const std::vector<Vec3>& points, Vec3d center) {
  const Ball& ball = balls[index];
  const float radius = std::sqrt(exponent_reach(ball, kTail) / ball.a);
  std::vector<std::uint32_t> near;
  for (std::uint32_t j = 0; j < balls.size(); ++j) {
    const float reach = std::sqrt(std::max(balls[j].w + kCutoff, 0.0f) / balls[j].a) * widest[j];
    const float both = reach + radius * widest[index];
    const Vec3 d = balls[j].center - ball.center;
    if (dot(d, d) < both * both) near.push_back(j);
  }
  const Mat3 map = to_ellipsoid(ball);
  // The values first, then their sum: the compiler makes packs of the first loop.
  const auto value = [](const Ball& b, Vec3 x) {
    constexpr float kLog2E = 1.44269504f, kMin = -120;
    const float exponent = kLog2E * (b.w - b.a * quadratic(b.shape, x - b.center));
    return exp2(exponent > kMin ? exponent : kMin);
  };
  std::vector<Ball> others;
  for (const std::uint32_t j : near) others.push_back(balls[j]);
  std::vector<float> values(others.size());
  Part sum;
  for (const Vec3& point : points) {
    const Vec3 x = ball.center + to_float(map * (Vec3d(point) * static_cast<double>(radius)));
    for (std::size_t j = 0; j < others.size(); ++j) values[j] = value(others[j], x);
    const float field = std::accumulate(values.begin(), values.end(), 0.0f);
    if (!(field > 1)) continue;
    const auto share = static_cast<double>(value(ball, x) / field);
    const Vec3d offset = Vec3d(x) - center;
    sum.volume += share;
    sum.squares += share * dot(offset, offset);
  }
  constexpr double kUnitBall = 4.18879020478639;
  const auto r = static_cast<double>(radius);
  const double count = static_cast<double>(points.size());
  return {kUnitBall * r * r * r * sum.volume / count, kUnitBall * r * r * r * sum.squares / count};
}

/// The masses of balls whose field lets them melt into each other.
std::vector<Part> parts_inside(const std::vector<Ball>& balls, Vec3d center) {
  // Some 65 000 points in all: thousands of balls differ little from their neighbours.
  const std::vector<Vec3> points =
      points_in_ball(std::clamp<std::size_t>(65536 / balls.size(), 8, 1024));
  std::vector<float> widest(balls.size());
  for (std::size_t i = 0; i < balls.size(); ++i) widest[i] = widest_axis(balls[i]);
  std::vector<Part> parts(balls.size());
  parallel_for(static_cast<std::int64_t>(balls.size()), [&](std::int64_t i) {
    const auto at = static_cast<std::size_t>(i);
    parts[at] = part_inside(balls, at, widest, points, center);
  });
  return parts;
}

/// The masses of balls that are told apart: each as large as it is alone.
std::vector<Part> lone_parts(const std::vector<Ball>& balls, FieldKind kind, Vec3d center) {
  std::vector<Part> parts;
  for (const Ball& ball : balls) {
    const auto r = static_cast<double>(visit(kind, [&](auto field) { return field.radius(ball); }));
    const Vec3d offset = Vec3d(ball.center) - center;
    const double volume = r * r * r;  // in units of the unit ball's
    parts.push_back({volume, volume * (dot(offset, offset) + 0.6 * r * r)});
  }
  return parts;
}

std::vector<Part> mass_parts(const std::vector<Ball>& balls, FieldKind kind, Vec3d center) {
  return visit(kind, [](auto field) { return decltype(field)::kExponential; })
             ? parts_inside(balls, center)
             : lone_parts(balls, kind, center);
}

}  // namespace

std::vector<double> ball_masses(const std::vector<Ball>& balls, FieldKind kind) {
  std::vector<double> masses;
  for (const Part& part : mass_parts(balls, kind, {})) masses.push_back(part.volume);
  const double sum = std::accumulate(masses.begin(), masses.end(), 0.0);
  const auto count = static_cast<double>(balls.size());
  if (!(sum > 0)) return std::vector<double>(balls.size(), 1 / count);
  for (double& mass : masses) mass = std::max(mass / sum, 1e-4 / count);
  const double floored = std::accumulate(masses.begin(), masses.end(), 0.0);
  for (double& mass : masses) mass /= floored;
  return masses;
}

double radius_of_gyration(const std::vector<Ball>& balls, FieldKind kind, Vec3d center) {
  Part sum;
  for (const Part& part : mass_parts(balls, kind, center)) {
    sum.volume += part.volume;
    sum.squares += part.squares;
  }
  return sum.squares > 0 ? std::sqrt(sum.squares / sum.volume) : 1;
}

}  // namespace polymorph
