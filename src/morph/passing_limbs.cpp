#include "morph/passing_limbs.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/result.h"
#include "morph/motion.h"
#include "morph/parts.h"

namespace polymorph {
namespace {

/// Distances up to which the nearness of two balls is 1, and from which on it is 0, as fractions of
/// the objects' size.
constexpr float kFullDistance = 0.1f, kZeroDistance = 0.2f;
/// Two balls count as passing if they are nearer than at both ends: fully so once their squared
/// distance is smaller by (kPassingLength * size)^2.
constexpr float kPassingLength = 0.06f;

float squared_length(Vec3 v) { return dot(v, v); }

}  // namespace

std::vector<float> passing_weights(const MorphPlan& plan, const std::vector<float>& eased,
                                   const BallSet& balls, float size) {
  PM_CHECK(balls.size() == plan.pairs.size() && eased.size() == plan.pairs.size() && size > 0);
  std::vector<float> weights(balls.size(), 0);
  const std::vector<std::uint32_t> limbs = parts_by_limb(plan);
  if (limbs.empty()) return weights;
  // Distances at the ends are scaled to the object's size at this time.
  const double log_scale = mean_path_part(plan).log_scale,
               u = static_cast<double>(mean_progress(plan, eased));
  const auto from_scale = static_cast<float>(exp_scalar(log_scale * u)),
             to_scale = static_cast<float>(exp_scalar(log_scale * (u - 1)));
  const auto passing_weight = [&](std::size_t e, std::size_t f) {
    const float distance2 = squared_length(balls[e].center - balls[f].center);
    if (distance2 >= kZeroDistance * size * (kZeroDistance * size)) return 0.0f;
    const BallPath &a = plan.paths->balls[e], &b = plan.paths->balls[f];
    const float end_distance2 =
        std::min(squared_length((a.start.center - b.start.center) * from_scale),
                 squared_length((a.end.center - b.end.center) * to_scale));
    const float approach =
        (end_distance2 - distance2) / (kPassingLength * size * (kPassingLength * size));
    const float nearness =
        (kZeroDistance - std::sqrt(distance2) / size) / (kZeroDistance - kFullDistance);
    return std::clamp(approach, 0.0f, 1.0f) * std::min(nearness, 1.0f);
  };
  parallel_for(
      static_cast<std::int64_t>(balls.size()),
      [&](std::int64_t index) {
        const auto e = static_cast<std::size_t>(index);
        if (limbs[e] == 0) return;
        for (std::size_t f = 0; f < balls.size(); ++f)
          if (limbs[f] != 0 && limbs[f] != limbs[e])
            weights[e] = std::max(weights[e], passing_weight(e, f));
      },
      /*grain=*/16);
  return weights;
}

}  // namespace polymorph
