#include "morph/posed_plan.h"

#include "base/result.h"
#include "morph/motion.h"
#include "morph/parts.h"

namespace polymorph {
namespace {

/// The turn of an object as a whole: the mean of its balls', by mass.
Mat3 mean_turn(const CarriedBalls& carried, const std::vector<double>& masses) {
  if (carried.turns.empty()) return {};
  Mat3 sum{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  for (std::size_t i = 0; i < masses.size(); ++i)
    for (int k = 0; k < 9; ++k) sum.m[k] += masses[i] * carried.turns[i].m[k];
  return nearest_rotation(sum);
}

Alignment posed_alignment(const MorphPlan& plan, const CarriedBalls& from, const CarriedBalls& to) {
  Alignment alignment = plan.alignment;
  if (!from.turns.empty() || !to.turns.empty()) {
    alignment.rotation = mean_turn(to, plan.to_masses) * plan.alignment.rotation *
                         transposed(mean_turn(from, plan.from_masses));
    alignment.turn = log_rotation_near(alignment.rotation, plan.alignment.turn);
  }
  alignment.from_center = alignment.to_center = {};
  for (const Pair& pair : plan.pairs) {
    alignment.from_center = alignment.from_center + Vec3d(from.balls[pair.from].center) * pair.mass;
    alignment.to_center = alignment.to_center + Vec3d(to.balls[pair.to].center) * pair.mass;
  }
  return alignment;
}

/// Turns each pair's offset with its ball.
template <class Index>
void turn_offsets(const CarriedBalls& carried, const std::vector<Pair>& pairs, const Index& index,
                  std::vector<Vec3>& offsets) {
  if (carried.turns.empty()) return;
  for (std::size_t e = 0; e < offsets.size(); ++e)
    offsets[e] = to_float(carried.turns[index(pairs[e])] * Vec3d(offsets[e]));
}

}  // namespace

MorphPlan posed_plan(const MorphPlan& reference, const CarriedBalls& from, const CarriedBalls& to) {
  PM_CHECK(from.balls.size() == reference.from.size() && to.balls.size() == reference.to.size());
  MorphPlan plan = reference;
  plan.from = from.balls;
  plan.to = to.balls;
  plan.alignment = posed_alignment(reference, from, to);
  turn_offsets(
      from, plan.pairs, [](const Pair& pair) { return pair.from; }, plan.from_offsets);
  turn_offsets(
      to, plan.pairs, [](const Pair& pair) { return pair.to; }, plan.to_offsets);
  RigidParts parts = carried_parts(plan, reference);
  if (reference.graph)
    plan.graph = std::make_shared<const BallGraph>(plan, parts, *reference.graph);
  lay_paths(plan, std::move(parts));
  return plan;
}

}  // namespace polymorph
