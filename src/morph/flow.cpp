#include "morph/flow.h"

#include "field/extract_surface.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// Inverts a matrix: the cross products of its rows, over its determinant, are the columns.
Mat3 inverse(const Mat3& a) {
  const auto row = [&](int i) { return Vec3d{a.at(i, 0), a.at(i, 1), a.at(i, 2)}; };
  const Vec3d x = row(0), y = row(1), z = row(2);
  const double determinant = dot(x, cross(y, z));
  return from_columns(cross(y, z) * (1 / determinant), cross(z, x) * (1 / determinant),
                      cross(x, y) * (1 / determinant));
}

}  // namespace

Result<Flow> flow_at(PlanMoment now, PlanMoment next, const BallSet& balls,
                     const std::vector<Vec3>& points, Engine& engine) {
  const MorphPlan& plan = now.plan;
  PM_CHECK(balls.size() == plan.pairs.size());
  const std::vector<float> progress = pair_progress(plan, now.time);
  std::vector<BallAttribute> attributes(balls.size());
  for (std::size_t e = 0; e < balls.size(); ++e) attributes[e].value[3] = progress[e];
  if (differ(now, next)) {
    const std::vector<Ball> next_balls = balls_at(next.plan, next.time);
    const std::vector<PairMaps> now_maps = pair_maps(plan, now.time),
                                next_maps = pair_maps(next.plan, next.time);
    for (std::size_t e = 0; e < balls.size(); ++e) {
      // The term of pair e, as a linear function of x - x_e: (x'_e - x_e) + (G_e - I) (x - x_e).
      const Vec3 displacement = next_balls[e].center - balls[e].center;
      const Mat3 rotation_and_scale = inverse(next_maps[e].to_source) * now_maps[e].to_source;
      set_linear(attributes[e], displacement, minus(rotation_and_scale, Mat3{}));
    }
  }
  PM_TRY(const std::vector<AttributeValues> values,
         interpolate_attributes(engine, balls, plan.kind, attributes, points));
  return read_flow(values);
}

Flow read_flow(const std::vector<AttributeValues>& values) {
  Flow flow;
  for (const AttributeValues& value : values) {
    flow.displacement.push_back({value.v[0], value.v[1], value.v[2]});
    flow.progress.push_back(value.v[3]);
  }
  return flow;
}

}  // namespace polymorph
