#include "morph/pull_back.h"

#include "base/result.h"
#include "morph/motion.h"
#include "surface/near_balls.h"

namespace polymorph {

PullBack pull_back(const MorphPlan& plan, float time, std::span<const Ball> balls,
                   std::span<const Vec3> points) {
  PM_CHECK(balls.size() == plan.pairs.size());
  const std::vector<PairFrame> frames = pair_frames(plan, time);
  const NearBalls near(balls, plan.kind);
  PullBack pulled;
  pulled.source.resize(points.size());
  pulled.target.resize(points.size());
  for_each_share(near, points, [&](std::size_t i, std::span<const BallShare> shares) {
    Vec3d source, target;
    for (const auto& [e, share] : shares) {
      const auto q = static_cast<double>(share);
      const Vec3d offset = Vec3d(points[i]) - Vec3d(balls[e].center);
      source =
          source + (Vec3d(plan.from[plan.pairs[e].from].center) + frames[e].to_source * offset) * q;
      target =
          target + (Vec3d(plan.to[plan.pairs[e].to].center) + frames[e].to_target * offset) * q;
    }
    pulled.source[i] = to_float(source);
    pulled.target[i] = to_float(target);
  });
  return pulled;
}

}  // namespace polymorph
