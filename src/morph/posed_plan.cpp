#include "morph/posed_plan.h"

#include <algorithm>
#include <span>

#include "base/result.h"
#include "morph/motion.h"
#include "morph/parts.h"

namespace polymorph {
namespace {

/// The rotation of the whole object: the mean of its balls' rotations, weighted by mass.
Mat3 mean_rotation(const CarriedBalls& carried, const std::vector<double>& masses) {
  if (carried.rotations.empty()) return {};
  Mat3 sum{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  for (std::size_t i = 0; i < masses.size(); ++i)
    for (int k = 0; k < 9; ++k) sum.m[k] += masses[i] * carried.rotations[i].m[k];
  return nearest_rotation(sum);
}

/// The alignment of the posed objects: the plan's rotation, combined with the mean rotations of
/// both objects' balls, and new centres.
Alignment posed_alignment(const MorphPlan& plan, const CarriedBalls& from, const CarriedBalls& to) {
  Alignment alignment = plan.alignment;
  if (!from.rotations.empty() || !to.rotations.empty()) {
    alignment.rotation = mean_rotation(to, plan.to_masses) * plan.alignment.rotation *
                         transposed(mean_rotation(from, plan.from_masses));
    alignment.rotation_vector =
        log_rotation_near(alignment.rotation, plan.alignment.rotation_vector);
  }
  alignment.from_center = alignment.to_center = {};
  for (const Pair& pair : plan.pairs) {
    alignment.from_center = alignment.from_center + Vec3d(from.balls[pair.from].center) * pair.mass;
    alignment.to_center = alignment.to_center + Vec3d(to.balls[pair.to].center) * pair.mass;
  }
  return alignment;
}

/// Rotates each pair's offset with its ball; index(pair) is that ball.
template <class Index>
void rotate_offsets(const CarriedBalls& carried, const std::vector<Pair>& pairs, const Index& index,
                    std::vector<Vec3>& offsets) {
  if (carried.rotations.empty()) return;
  for (std::size_t e = 0; e < offsets.size(); ++e)
    offsets[e] = to_float(carried.rotations[index(pairs[e])] * Vec3d(offsets[e]));
}

/// Moves each point with the ball that is nearest to it.
void carry_points(const CarriedBalls& carried, const std::vector<Ball>& reference,
                  std::span<Vec3> points) {
  for (Vec3& point : points) {
    const auto distance = [&](const Ball& ball) { return length(ball.center - point); };
    const auto nearest = static_cast<std::size_t>(
        std::ranges::min_element(reference, {}, distance) - reference.begin());
    const Vec3d offset = Vec3d(point) - Vec3d(reference[nearest].center);
    const Vec3d posed_offset =
        carried.rotations.empty() ? offset : carried.rotations[nearest] * offset;
    point = to_float(Vec3d(carried.balls[nearest].center) + posed_offset);
  }
}

/// Moves the limbs' curves of both objects, and the counterparts of lone limbs on the other object,
/// with the balls nearest to them. Sets `plan.lone_roots` to the moved points.
void pose_curves(const MorphPlan& reference, const CarriedBalls& from, const CarriedBalls& to,
                 MorphPlan& plan) {
  const auto pose = [](LimbCurves& curves, const CarriedBalls& own,
                       const std::vector<Ball>& own_balls, const CarriedBalls& other,
                       const std::vector<Ball>& other_balls) {
    for (std::vector<LimbCurve>* limbs : {&curves.matched, &curves.lone})
      for (LimbCurve& limb : *limbs) carry_points(own, own_balls, limb.points);
    carry_points(other, other_balls, curves.counterparts);
  };
  pose(plan.from_curves, from, reference.from, to, reference.to);
  pose(plan.to_curves, to, reference.to, from, reference.from);
  std::size_t next = 0;
  for (std::size_t n = 0; n < plan.from_curves.lone.size(); ++n, ++next) {
    plan.lone_roots[next].from = plan.from_curves.lone[n].points[0];
    plan.lone_roots[next].to = plan.from_curves.counterparts[n];
  }
  for (std::size_t n = 0; n < plan.to_curves.lone.size(); ++n, ++next) {
    plan.lone_roots[next].from = plan.to_curves.counterparts[n];
    plan.lone_roots[next].to = plan.to_curves.lone[n].points[0];
  }
}

}  // namespace

MorphPlan posed_plan(const MorphPlan& reference, const CarriedBalls& from, const CarriedBalls& to) {
  PM_CHECK(from.balls.size() == reference.from.size() && to.balls.size() == reference.to.size());
  MorphPlan plan = reference;
  plan.from = from.balls;
  plan.to = to.balls;
  plan.alignment = posed_alignment(reference, from, to);
  rotate_offsets(
      from, plan.pairs, [](const Pair& pair) { return pair.from; }, plan.from_offsets);
  rotate_offsets(
      to, plan.pairs, [](const Pair& pair) { return pair.to; }, plan.to_offsets);
  pose_curves(reference, from, to, plan);
  RigidParts parts = refit_parts(plan, reference);
  if (reference.graph)
    plan.graph = std::make_shared<const BallGraph>(plan, parts, *reference.graph);
  set_ball_paths(plan, std::move(parts));
  return plan;
}

}  // namespace polymorph
