#include "morph/plan_cycle.h"

#include <algorithm>
#include <cmath>

namespace polymorph {
namespace {

/// Moments of the positions to which a ball's mass returns at the end of the cycle. Positions are
/// relative to the centre of the first object.
struct Return {
  Vec3d mean;         ///< mean position
  double square = 0;  ///< mean squared distance from the centre
};

/// Tests whether two lists of balls have the same centres up to rounding.
bool are_same(const std::vector<Ball>& a, const std::vector<Ball>& b, double size) {
  constexpr double kRounding = 1e-4;  // fraction of `size`
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [&](const Ball& p, const Ball& q) {
           return length(Vec3d(p.center) - Vec3d(q.center)) <= kRounding * size;
         });
}

/// Computes the returns of a plan's source balls. `to`: the returns of its target balls, to which a
/// source ball's mass goes by the pairs' shares.
std::vector<Return> step_back(const MorphPlan& plan, const std::vector<Return>& to) {
  std::vector<Return> from(plan.from.size());
  std::vector<double> shares(plan.from.size());
  for (const Pair& pair : plan.pairs) {
    const double share = static_cast<double>(pair.from_share);
    from[pair.from].mean = from[pair.from].mean + to[pair.to].mean * share;
    from[pair.from].square += share * to[pair.to].square;
    shares[pair.from] += share;
  }
  for (std::size_t i = 0; i < from.size(); ++i) {
    from[i].mean = from[i].mean * (1 / shares[i]);
    from[i].square /= shares[i];
  }
  return from;
}

}  // namespace

std::optional<CycleError> cycle_error(const std::vector<const MorphPlan*>& plans) {
  if (plans.empty()) return std::nullopt;
  for (std::size_t k = 1; k < plans.size(); ++k)
    if (plans[k - 1]->to.size() != plans[k]->from.size()) return std::nullopt;
  const MorphPlan& first = *plans.front();
  const std::vector<double>& masses = first.from_masses;
  Vec3d center;
  double mass = 0, squared_radius = 0;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    center = center + Vec3d(first.from[i].center) * masses[i];
    mass += masses[i];
  }
  center = center * (1 / mass);
  // For the balls at the end of the cycle, all mass is at the ball itself. From there, go back plan
  // by plan.
  std::vector<Return> returns(first.from.size());
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const Vec3d position = Vec3d(first.from[i].center) - center;
    returns[i] = {position, dot(position, position)};
    squared_radius += masses[i] * returns[i].square;
  }
  const std::vector<Return> initial = returns;
  if (squared_radius <= 0 ||
      !are_same(first.from, plans.back()->to, std::sqrt(squared_radius / mass)))
    return std::nullopt;
  std::for_each(plans.rbegin(), plans.rend(),
                [&](const MorphPlan* plan) { returns = step_back(*plan, returns); });
  double drift = 0, spread = 0;
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const Vec3d offset = returns[i].mean - initial[i].mean;
    drift += masses[i] * dot(offset, offset);
    spread += masses[i] * std::max(returns[i].square - dot(returns[i].mean, returns[i].mean), 0.0);
  }
  return CycleError{std::sqrt(drift / squared_radius), std::sqrt(spread / squared_radius)};
}

}  // namespace polymorph
