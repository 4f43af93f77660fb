#include "morph/flow.h"

#include "field/extract_surface.h"
#include "morph/motion.h"

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

Result<Flow> flow_at(PlanMoment now, PlanMoment next, const BallSet& balls,
                     const std::vector<Vec3>& points, Engine& engine) {
  const MorphPlan& plan = now.plan;
  PM_CHECK(balls.size() == plan.pairs.size());
  const std::vector<float> progress = pair_progress(plan, now.time);
  std::vector<BallAttribute> carried(balls.size());
  for (std::size_t e = 0; e < balls.size(); ++e) carried[e].value[3] = progress[e];
  if (differ(now, next)) {
    const std::vector<Ball> later = balls_at(next.plan, next.time);
    const std::vector<PairFrame> frames = pair_frames(plan, now.time),
                                 then = pair_frames(next.plan, next.time);
    for (std::size_t e = 0; e < balls.size(); ++e) {
      const Vec3 step = later[e].center - balls[e].center;
      const Mat3 turn = inverse(then[e].to_source) * frames[e].to_source;
      for (int i = 0; i < 3; ++i) {
        const auto moved = [&](int k) { return turn.at(i, k) - (i == k ? 1 : 0); };
        carried[e].value[i] = i == 0 ? step.x : i == 1 ? step.y : step.z;
        carried[e].slope[i] = to_float({moved(0), moved(1), moved(2)});
      }
    }
  }
  PM_TRY(const std::vector<AttributeValues> values,
         interpolate_attributes(engine, balls, plan.kind, carried, points));
  return read_flow(values);
}

Flow read_flow(const std::vector<AttributeValues>& values) {
  Flow flow;
  for (const AttributeValues& at : values) {
    flow.displacement.push_back({at.v[0], at.v[1], at.v[2]});
    flow.progress.push_back(at.v[3]);
  }
  return flow;
}

}  // namespace polymorph
