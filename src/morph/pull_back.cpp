#include "morph/pull_back.h"

#include "field/extract_surface.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// The place that a ball's centre stands for, and how offsets from there are turned.
BallAttribute affine(Vec3 center, const Mat3& turn) {
  BallAttribute carried = {{center.x, center.y, center.z, 0}, {}};
  for (int i = 0; i < 3; ++i)
    carried.slope[i] = to_float({turn.at(i, 0), turn.at(i, 1), turn.at(i, 2)});
  return carried;
}

}  // namespace

Result<PullBack> pull_back(const MorphPlan& plan, float time, const BallSet& balls,
                           const std::vector<Vec3>& points, Engine& engine) {
  PM_CHECK(balls.size() == plan.pairs.size());
  const std::vector<PairFrame> frames = pair_frames(plan, time);
  std::vector<BallAttribute> carried;
  for (std::size_t e = 0; e < balls.size(); ++e) {
    carried.push_back(affine(plan.from[plan.pairs[e].from].center, frames[e].to_source));
    carried.push_back(affine(plan.to[plan.pairs[e].to].center, frames[e].to_target));
  }
  PM_TRY(const std::vector<AttributeValues> values,
         interpolate_attributes(engine, balls, plan.kind, carried, points));
  return read_pull_back(values);
}

PullBack read_pull_back(const std::vector<AttributeValues>& values) {
  PullBack pulled;
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) {
    const float *source = values[i].v, *target = values[i + 1].v;
    pulled.source.push_back({source[0], source[1], source[2]});
    pulled.target.push_back({target[0], target[1], target[2]});
    pulled.progress.push_back(source[3]);
  }
  return pulled;
}

}  // namespace polymorph
