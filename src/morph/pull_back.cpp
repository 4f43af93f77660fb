#include "morph/pull_back.h"

#include "field/extract_surface.h"
#include "morph/motion.h"

namespace polymorph {

Result<PullBack> pull_back(const MorphPlan& plan, float time, const BallSet& balls,
                           const std::vector<Vec3>& points, Engine& engine) {
  PM_CHECK(balls.size() == plan.pairs.size());
  const std::vector<PairMaps> maps = pair_maps(plan, time);
  std::vector<BallAttribute> attributes(2 * balls.size());
  for (std::size_t e = 0; e < balls.size(); ++e) {
    const Pair& pair = plan.pairs[e];
    set_linear(attributes[2 * e], plan.from[pair.from].center, maps[e].to_source);
    set_linear(attributes[2 * e + 1], plan.to[pair.to].center, maps[e].to_target);
  }
  PM_TRY(const std::vector<AttributeValues> values,
         interpolate_attributes(engine, balls, plan.kind, attributes, points));
  return read_pull_back(values);
}

PullBack read_pull_back(const std::vector<AttributeValues>& values) {
  PullBack result;
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) {
    const float *source = values[i].v, *target = values[i + 1].v;
    result.source.push_back({source[0], source[1], source[2]});
    result.target.push_back({target[0], target[1], target[2]});
    result.progress.push_back(source[3]);
  }
  return result;
}

}  // namespace polymorph
