#include "morph/passing_limbs.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/result.h"
#include "morph/motion.h"
#include "morph/parts.h"

namespace polymorph {
namespace {

/// Distances over which the nearness of two balls falls from 1 to 0, as fractions of the size.
constexpr float kFullDistance = 0.1f, kZeroDistance = 0.2f;
/// Path length at which a ball counts as fully passing, as a fraction of the size.
constexpr float kPassingLength = 0.06f;

float squared_length(Vec3 v) { return dot(v, v); }

}  // namespace

std::vector<float> passing_weights(const MorphPlan& plan, const std::vector<float>& eased,
                                   const BallSet& balls, float size) {
  PM_CHECK(balls.size() == plan.pairs.size() && eased.size() == plan.pairs.size() && size > 0);
  std::vector<float> shares(balls.size(), 0);
  const std::vector<std::uint32_t> limbs = parts_by_limb(plan);
  if (limbs.empty()) return shares;
  // Distances at the ends are scaled to the present size of the object.
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
    const float passed =
        (end_distance2 - distance2) / (kPassingLength * size * (kPassingLength * size));
    const float nearness =
        (kZeroDistance - std::sqrt(distance2) / size) / (kZeroDistance - kFullDistance);
    return std::clamp(passed, 0.0f, 1.0f) * std::min(nearness, 1.0f);
  };
  parallel_for(
      static_cast<std::int64_t>(balls.size()),
      [&](std::int64_t index) {
        const auto e = static_cast<std::size_t>(index);
        if (limbs[e] == 0) return;
        for (std::size_t f = 0; f < balls.size(); ++f)
          if (limbs[f] != 0 && limbs[f] != limbs[e])
            shares[e] = std::max(shares[e], passing_weight(e, f));
      },
      16);
  return shares;
}

}  // namespace polymorph
