#include "morph/passing_limbs.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/result.h"
#include "morph/motion.h"
#include "morph/parts.h"

namespace polymorph {
namespace {

/// Shares of the objects' size: balls of two limbs are near up to kNear, and not beyond kFar.
constexpr float kNear = 0.1f, kFar = 0.2f;
/// The length along which one passes another fully, a share of the size.
constexpr float kPassing = 0.06f;

float squared_length(Vec3 v) { return dot(v, v); }

}  // namespace

std::vector<float> passing_shares(const MorphPlan& plan, const std::vector<float>& eased,
                                  const BallSet& balls, float size) {
  PM_CHECK(balls.size() == plan.pairs.size() && eased.size() == plan.pairs.size() && size > 0);
  std::vector<float> shares(balls.size(), 0);
  const std::vector<std::uint32_t> limbs = parts_by_limb(plan);
  if (limbs.empty()) return shares;
  // Distances at the ends count by the size that the whole has now.
  const double growth = mean_path_part(plan).log_scale,
               u = static_cast<double>(mean_progress(plan, eased));
  const auto from_scale = static_cast<float>(exp_scalar(growth * u)),
             to_scale = static_cast<float>(exp_scalar(growth * (u - 1)));
  const auto share_between = [&](std::size_t e, std::size_t f) {
    const float distance2 = squared_length(balls[e].center - balls[f].center);
    if (distance2 >= kFar * size * (kFar * size)) return 0.0f;
    const BallPath &a = plan.paths->balls[e], &b = plan.paths->balls[f];
    const float at_ends = std::min(squared_length((a.start.center - b.start.center) * from_scale),
                                   squared_length((a.end.center - b.end.center) * to_scale));
    const float passed = (at_ends - distance2) / (kPassing * size * (kPassing * size));
    const float near = (kFar - std::sqrt(distance2) / size) / (kFar - kNear);
    return std::clamp(passed, 0.0f, 1.0f) * std::min(near, 1.0f);
  };
  parallel_for(
      static_cast<std::int64_t>(balls.size()),
      [&](std::int64_t index) {
        const auto e = static_cast<std::size_t>(index);
        if (limbs[e] == 0) return;
        for (std::size_t f = 0; f < balls.size(); ++f)
          if (limbs[f] != 0 && limbs[f] != limbs[e])
            shares[e] = std::max(shares[e], share_between(e, f));
      },
      16);
  return shares;
}

}  // namespace polymorph
