#include "leg/crossfade.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/result.h"
#include "field/near_balls.h"
#include "kernels/simd_math.h"

namespace polymorph {
namespace {

constexpr float kLog2E = 1.44269504f;

Vec3 shrink_target(Vec3 point, const std::vector<Ball>& balls, FieldKind kind) {
  // The first pass finds the largest contribution and the second divides by it, so that nothing
  // overflows or underflows.
  float max_log_strength = -std::numeric_limits<float>::infinity();
  for (const Ball& ball : balls) {
    const Vec3 d = point - ball.center;
    max_log_strength = std::max(max_log_strength, log_contribution(ball, kind, d));
  }
  if (!std::isfinite(max_log_strength)) return point;  // outside every ball's support
  double sum = 0, x = 0, y = 0, z = 0;
  for (const Ball& ball : balls) {
    const Vec3 d = point - ball.center;
    const float log_ratio = log_contribution(ball, kind, d) - max_log_strength;
    if (log_ratio < -12) continue;  // weight below exp(-24)
    // Squares are summed, because the far fields of inverse-square balls would pull all points to
    // the middle.
    const auto weight = static_cast<double>(exp2(2 * kLog2E * log_ratio));
    sum += weight;
    x += weight * static_cast<double>(ball.center.x);
    y += weight * static_cast<double>(ball.center.y);
    z += weight * static_cast<double>(ball.center.z);
  }
  return {static_cast<float>(x / sum), static_cast<float>(y / sum), static_cast<float>(z / sum)};
}

}  // namespace

std::vector<Vec3> shrink_targets(const Model& model, const std::vector<Ball>& balls,
                                 FieldKind kind) {
  PM_CHECK(!balls.empty());
  std::vector<Vec3> targets(model.points.size());
  parallel_for(
      static_cast<std::int64_t>(targets.size()),
      [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        targets[k] = shrink_target(model.points[k], balls, kind);
      },
      /*grain=*/64);
  return targets;
}

std::vector<Vec3> shrunk_points(const Model& model, const std::vector<Vec3>& targets,
                                float boundary) {
  PM_CHECK(targets.size() == model.points.size());
  std::vector<Vec3> points(model.points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = (1 - boundary) * targets[i] + boundary * model.points[i];  // exact at both ends
  return points;
}

}  // namespace polymorph
