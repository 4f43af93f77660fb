#include "morph/flow.h"

#include "base/result.h"
#include "morph/motion.h"
#include "surface/near_balls.h"

namespace polymorph {
namespace {

Mat3 inverse(const Mat3& a) {
  const auto row = [&](int i) { return Vec3d{a.at(i, 0), a.at(i, 1), a.at(i, 2)}; };
  const Vec3d x = row(0), y = row(1), z = row(2);
  const double volume = dot(x, cross(y, z));
  return from_columns(cross(y, z) * (1 / volume), cross(z, x) * (1 / volume),
                      cross(x, y) * (1 / volume));
}

}  // namespace

Flow flow_at(const MorphPlan& plan, float time, float next, std::span<const Ball> balls,
             std::span<const Vec3> points) {
  PM_CHECK(balls.size() == plan.pairs.size());
  const std::vector<float> progress = pair_progress(plan, time);
  const bool moves = next != time;
  std::vector<Ball> later;
  std::vector<Mat3> turns;
  if (moves) {
    later = balls_at(plan, next);
    const std::vector<PairFrame> now = pair_frames(plan, time), then = pair_frames(plan, next);
    for (std::size_t e = 0; e < now.size(); ++e)
      turns.push_back(inverse(then[e].to_source) * now[e].to_source);
  }
  const NearBalls near(balls, plan.kind);
  Flow flow;
  flow.displacement.resize(points.size());
  flow.blend.resize(points.size());
  for_each_share(near, points, [&](std::size_t i, std::span<const BallShare> shares) {
    Vec3d way;
    for (const auto& [e, share] : shares) {
      flow.blend[i] += share * progress[e];
      if (!moves) continue;
      const Vec3d offset = Vec3d(points[i]) - Vec3d(balls[e].center);
      way = way + (Vec3d(later[e].center) - Vec3d(balls[e].center) + turns[e] * offset - offset) *
                      static_cast<double>(share);
    }
    flow.displacement[i] = to_float(way);
  });
  return flow;
}

}  // namespace polymorph
