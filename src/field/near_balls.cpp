#include "field/near_balls.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/exact_math.h"
#include "base/parallel.h"
#include "base/result.h"
#include "kernels/field_kinds.h"

namespace polymorph {
namespace {

constexpr float kLog2E = 1.44269504f;  // log2(e), for exp(x) = exp2(x log2(e))
constexpr float kNegligibleLog = 12;   // a float sum loses contributions below e^-12 of the field

/// Smallest eigenvalue of a symmetric matrix of determinant 1 (Smith 1961).
float min_eigenvalue(const Sym3& s) {
  const double off_diagonal2 = static_cast<double>(s.xy) * s.xy + static_cast<double>(s.xz) * s.xz +
                               static_cast<double>(s.yz) * s.yz;
  const double mean = (static_cast<double>(s.xx) + s.yy + s.zz) / 3;
  const double x = s.xx - mean, y = s.yy - mean, z = s.zz - mean;
  const double p = std::sqrt((x * x + y * y + z * z + 2 * off_diagonal2) / 6);
  if (!(p > 0)) return static_cast<float>(mean);
  const double det = x * (y * z - static_cast<double>(s.yz) * s.yz) -
                     s.xy * (s.xy * z - static_cast<double>(s.yz) * s.xz) +
                     s.xz * (static_cast<double>(s.xy) * s.yz - y * s.xz);
  const double angle = exact::acos(std::clamp(det / (2 * p * p * p), -1.0, 1.0)) / 3;
  constexpr double kThirdTurn = 2.0943951023931953;  // 2 pi / 3
  return static_cast<float>(std::max(mean + 2 * p * exact::cos(angle + kThirdTurn), 1e-9));
}

/// Returns the squared distance of a point from a box; 0 inside.
float distance2(Vec3 p, const Box& box) {
  const Vec3 outside = max(max(box.low - p, p - box.high), Vec3{});
  return dot(outside, outside);
}

}  // namespace

float log_contribution(const Ball& ball, FieldKind kind, Vec3 d) {
  return visit(kind, [&](auto field) { return field.log_value(ball, field.coordinate(ball, d)); });
}

NearBalls::NearBalls(std::span<const Ball> balls, FieldKind kind) : balls_(balls), kind_(kind) {
  for (const Ball& ball : balls) min_a_.push_back(ball.a * min_eigenvalue(ball.shape));
}

std::vector<std::uint32_t> NearBalls::within(const Box& box) const {
  std::vector<std::uint32_t> list;
  if (!visit(kind_, [](auto field) { return decltype(field)::kCompactSupport; })) {
    for (std::size_t i = 0; i < balls_.size(); ++i) list.push_back(static_cast<std::uint32_t>(i));
    return list;
  }
  std::vector<float> max_log_values(balls_.size());  // upper bounds in the box
  float largest = -std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < balls_.size(); ++i) {
    const float q = min_a_[i] * distance2(balls_[i].center, box);  // lower bound in the box
    max_log_values[i] = visit(kind_, [&](auto field) { return field.log_value(balls_[i], q); });
    largest = std::max(largest, max_log_values[i]);
  }
  // The surface is at log field = 0, so much smaller contributions do not matter unless all are
  // small.
  const float threshold = std::min(largest, 0.0f) - kNegligibleLog;
  for (std::size_t i = 0; i < balls_.size(); ++i)
    if (max_log_values[i] >= threshold) list.push_back(static_cast<std::uint32_t>(i));
  return list;
}

LogField NearBalls::log_field(Vec3 p, std::span<const std::uint32_t> list) const {
  // Logarithms of the balls' contributions at first, in the end fractions of the field.
  thread_local std::vector<float> weights;
  weights.resize(list.size());
  float largest = -std::numeric_limits<float>::infinity();
  for (std::size_t k = 0; k < list.size(); ++k) {
    const Ball& ball = balls_[list[k]];
    weights[k] = log_contribution(ball, kind_, p - ball.center);
    largest = std::max(largest, weights[k]);
  }
  LogField field{static_cast<double>(largest), {}};
  if (!std::isfinite(largest)) return field;  // outside all supports
  double sum = 0;
  for (float& weight : weights) {
    // Contributions below e^-20 of the largest are too small to matter.
    weight = weight - largest < -20 ? 0.0f : exp2((weight - largest) * kLog2E);
    sum += static_cast<double>(weight);
  }
  field.value = static_cast<double>(largest) + exact::log(sum);
  const float scale = sum > 0 ? static_cast<float>(1 / sum) : 0.0f;
  for (std::size_t k = 0; k < list.size(); ++k) {
    weights[k] *= scale;
    if (weights[k] == 0) continue;
    const Ball& ball = balls_[list[k]];
    const Vec3 d = p - ball.center;
    const Vec3 log_gradient = visit(kind_, [&](auto kind) {
      return kind.coordinate_gradient(ball, d) * kind.log_slope(ball, kind.coordinate(ball, d));
    });
    field.gradient = field.gradient + weights[k] * log_gradient;
  }
  return field;
}

void for_each_near(
    const NearBalls& balls, std::span<const Vec3> points, float max_distance,
    const std::function<void(std::size_t, std::size_t, std::span<const std::uint32_t>)>& f) {
  constexpr std::size_t kChunk = 128;
  const std::size_t chunks = (points.size() + kChunk - 1) / kChunk;
  parallel_for(static_cast<std::int64_t>(chunks), [&](std::int64_t r) {
    const std::size_t begin = static_cast<std::size_t>(r) * kChunk;
    const std::size_t end = std::min(begin + kChunk, points.size());
    const Box box = bounding_box(points.subspan(begin, end - begin));
    const Vec3 margin{max_distance, max_distance, max_distance};
    f(begin, end, balls.within({box.low - margin, box.high + margin}));
  });
}

}  // namespace polymorph
