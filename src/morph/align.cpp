#include "morph/align.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/parallel.h"

namespace polymorph {
namespace {

constexpr std::size_t kRepresentatives = 80;

/// The turns of a cube: signed permutations of the axes, without reflections.
std::vector<Mat3> cube_turns() {
  std::vector<Mat3> turns;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 turn{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
      for (int row = 0; row < 3; ++row)
        turn.at(row, order[static_cast<std::size_t>(row)]) = (signs >> row) & 1 ? -1 : 1;
      const auto& m = turn.m;
      const double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) -
                                 m[1] * (m[3] * m[8] - m[5] * m[6]) +
                                 m[2] * (m[3] * m[7] - m[4] * m[6]);
      if (determinant > 0) turns.push_back(turn);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return turns;
}

TransportPlan plan_between(const CostSide& a, const CostSide& b, float label_cost) {
  return solve_transport(a.mass, b.mass, [&](std::uint32_t from, std::span<float> costs) {
    cost_row(a, b, label_cost, from, costs);
  });
}

struct Fit {
  Mat3 rotation;
  double cost = 0;
};

Fit refine(const CostSide& a, const CostSide& b, float label_cost, Mat3 rotation) {
  constexpr int kMaxSteps = 12;
  constexpr double kEnough = 1e-3;
  Fit best;
  for (int step = 0; step < kMaxSteps; ++step) {
    const TransportPlan plan = plan_between(turned(a, rotation), b, label_cost);
    if (step > 0 && !(plan.cost < (1 - kEnough) * best.cost)) break;
    best = {rotation, plan.cost};
    rotation = fit_rotation(a, b, plan.flows);
  }
  return best;
}

}  // namespace

Mat3 fit_rotation(const CostSide& a, const CostSide& b, std::span<const Flow> flows) {
  Mat3 sum{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  // The outward directions turn with the object and count as in the cost.
  for (std::size_t first = 0; first < CostSide::kTurning; first += 3)
    for (const Flow& flow : flows)
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
          sum.at(r, c) +=
              flow.amount *
              static_cast<double>(b.values[first + static_cast<std::size_t>(r)][flow.to]) *
              static_cast<double>(a.values[first + static_cast<std::size_t>(c)][flow.from]);
  return nearest_rotation(sum);
}

Mat3 find_rotation(const CostSide& a, const CostSide& b, float label_cost, double gain) {
  const CostSide few_a = coarse(a, kRepresentatives), few_b = coarse(b, kRepresentatives);
  const double unturned = plan_between(few_a, few_b, label_cost).cost;
  std::vector<Mat3> starts = cube_turns();
  starts.insert(starts.begin(), Mat3{});
  std::vector<Fit> fits(starts.size());
  parallel_for(static_cast<std::int64_t>(starts.size()), [&](std::int64_t i) {
    const auto at = static_cast<std::size_t>(i);
    fits[at] = refine(few_a, few_b, label_cost, starts[at]);
  });
  double least = fits[0].cost;
  for (const Fit& fit : fits) least = std::min(least, fit.cost);
  if (!(least < (1 - gain) * unturned)) return {};
  // Of turns within a hundredth of the gain, the smallest.
  const double enough = least + 0.01 * (unturned - least);
  const Fit* chosen = nullptr;
  for (const Fit& fit : fits)
    if (fit.cost <= enough &&
        (!chosen || angle_of(fit.rotation) < angle_of(chosen->rotation) - 1e-6))
      chosen = &fit;
  return chosen->rotation;
}

}  // namespace polymorph
