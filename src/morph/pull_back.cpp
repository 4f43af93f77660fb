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
  for_each_near(near, points, 0, [&](std::size_t begin, std::size_t end, auto list) {
    std::vector<float> shares;
    for (std::size_t i = begin; i < end; ++i) {
      near.log_field(points[i], list, shares);
      Vec3d source, target;
      double sum = 0;
      for (std::size_t k = 0; k < list.size(); ++k) {
        if (shares[k] < 1e-4f) continue;
        const std::uint32_t e = list[k];
        const auto q = static_cast<double>(shares[k]);
        const Vec3d offset = Vec3d(points[i]) - Vec3d(balls[e].center);
        sum += q;
        source = source +
                 (Vec3d(plan.from[plan.pairs[e].from].center) + frames[e].to_source * offset) * q;
        target =
            target + (Vec3d(plan.to[plan.pairs[e].to].center) + frames[e].to_target * offset) * q;
      }
      pulled.source[i] = to_float(source * (1 / sum));
      pulled.target[i] = to_float(target * (1 / sum));
    }
  });
  return pulled;
}

}  // namespace polymorph
