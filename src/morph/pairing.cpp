#include "morph/pairing.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "base/random.h"

namespace polymorph {
namespace {

/// A pair's balls: their indices in source and target.
using Ends = std::pair<std::uint32_t, std::uint32_t>;

/// Makes pairs of `ends`. A ball that is in several pairs has an equal share in each.
std::vector<Pair> with_equal_shares(const std::vector<Ends>& ends, std::size_t from,
                                    std::size_t to) {
  std::vector<float> from_uses(from), to_uses(to);
  for (const auto& [i, j] : ends) {
    ++from_uses[i];
    ++to_uses[j];
  }
  std::vector<Pair> pairs;
  for (const auto& [i, j] : ends) pairs.push_back({i, j, 1 / from_uses[i], 1 / to_uses[j]});
  return pairs;
}

/// A transport problem: the balls of each side that may be paired with each other.
struct Subproblem {
  std::vector<std::uint32_t> from, to;
};

/// Divides the balls into transport problems: one per label that both sides have with
/// LabelMode::kHard, otherwise one of all balls. Balls whose label the other side lacks form one
/// more problem or, if only one side has such balls, join the other problems.
std::vector<Subproblem> split_by_label(const CostPair& sides, LabelMode mode) {
  std::map<std::int32_t, Subproblem> by_label;
  // Balls whose label no ball of the other side has.
  std::vector<std::uint32_t> unmatched_from, unmatched_to;
  for (std::uint32_t i = 0; i < sides.a.size(); ++i)
    by_label[mode == LabelMode::kHard ? sides.a.labels[i] : 0].from.push_back(i);
  for (std::uint32_t j = 0; j < sides.b.size(); ++j)
    by_label[mode == LabelMode::kHard ? sides.b.labels[j] : 0].to.push_back(j);
  std::vector<Subproblem> subproblems;
  for (auto& [label, subproblem] : by_label) {
    if (!subproblem.from.empty() && !subproblem.to.empty()) {
      subproblems.push_back(std::move(subproblem));
      continue;
    }
    unmatched_from.insert(unmatched_from.end(), subproblem.from.begin(), subproblem.from.end());
    unmatched_to.insert(unmatched_to.end(), subproblem.to.begin(), subproblem.to.end());
  }
  if (!unmatched_from.empty() && !unmatched_to.empty()) {
    subproblems.push_back({std::move(unmatched_from), std::move(unmatched_to)});
    return subproblems;
  }
  // At most one side has balls whose label the other side lacks. Each of them joins the subproblem
  // of the ball with which it would be paired at the lowest cost.
  const auto subproblem_of = [&](bool from_side, std::uint32_t ball) {
    for (std::size_t k = 0; k < subproblems.size(); ++k) {
      const auto& list = from_side ? subproblems[k].from : subproblems[k].to;
      if (std::binary_search(list.begin(), list.end(), ball)) return k;
    }
    return std::size_t{0};  // not reached: every ball of the other side is in a subproblem
  };
  const bool unmatched_is_from = !unmatched_from.empty();
  const CostSide& unmatched_side = unmatched_is_from ? sides.a : sides.b;
  const CostSide& other_side = unmatched_is_from ? sides.b : sides.a;
  std::vector<std::size_t> chosen_problems;
  std::vector<float> row(other_side.size());
  for (const std::uint32_t ball : unmatched_is_from ? unmatched_from : unmatched_to) {
    cost_row(unmatched_side, other_side, /*label_cost=*/0, ball, row);
    chosen_problems.push_back(subproblem_of(
        !unmatched_is_from,
        static_cast<std::uint32_t>(std::min_element(row.begin(), row.end()) - row.begin())));
  }
  for (std::size_t k = 0; k < chosen_problems.size(); ++k)
    (unmatched_is_from ? subproblems[chosen_problems[k]].from : subproblems[chosen_problems[k]].to)
        .push_back((unmatched_is_from ? unmatched_from : unmatched_to)[k]);
  return subproblems;
}

/// Removes pairs that carry less than kMinShare of both their balls and are neither ball's largest
/// pair, and rescales the others so that the shares of a ball sum to 1 again. Such minor pairs may
/// be half of all.
std::vector<Pair> drop_minor_pairs(std::vector<Pair> pairs, std::size_t from, std::size_t to) {
  constexpr float kMinShare = 0.08f;
  std::vector<float> from_max(from, 0), to_max(to, 0);
  for (const Pair& pair : pairs) {
    from_max[pair.from] = std::max(from_max[pair.from], pair.from_share);
    to_max[pair.to] = std::max(to_max[pair.to], pair.to_share);
  }
  std::erase_if(pairs, [&](const Pair& pair) {
    return pair.from_share < kMinShare && pair.to_share < kMinShare &&
           pair.from_share < from_max[pair.from] && pair.to_share < to_max[pair.to];
  });
  std::vector<double> from_sum(from, 0), to_sum(to, 0);
  for (const Pair& pair : pairs) {
    from_sum[pair.from] += static_cast<double>(pair.from_share);
    to_sum[pair.to] += static_cast<double>(pair.to_share);
  }
  for (Pair& pair : pairs) {
    pair.from_share =
        static_cast<float>(static_cast<double>(pair.from_share) / from_sum[pair.from]);
    pair.to_share = static_cast<float>(static_cast<double>(pair.to_share) / to_sum[pair.to]);
  }
  return pairs;
}

}  // namespace

std::vector<Pair> pair_by_index(std::size_t from_count, std::size_t to_count, std::uint64_t seed) {
  std::vector<Ends> ends(std::max(from_count, to_count));
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto random = [&](std::size_t n) {
      return random_below(static_cast<std::uint32_t>(n), seed, 0, i);
    };
    ends[i] = {i < from_count ? static_cast<std::uint32_t>(i) : random(from_count),
               i < to_count ? static_cast<std::uint32_t>(i) : random(to_count)};
  }
  return with_equal_shares(ends, from_count, to_count);
}

std::vector<Pair> pair_nearest(const CostPair& sides) {
  const auto n = static_cast<std::uint32_t>(sides.a.size());
  const auto m = static_cast<std::uint32_t>(sides.b.size());
  std::vector<Ends> ends;
  std::vector<float> row(m), cheapest(m, std::numeric_limits<float>::infinity());
  std::vector<std::uint32_t> nearest(m, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    cost_row(sides.a, sides.b, sides.label_cost, i, row);
    ends.emplace_back(
        i, static_cast<std::uint32_t>(std::min_element(row.begin(), row.end()) - row.begin()));
    for (std::uint32_t j = 0; j < m; ++j)
      if (row[j] < cheapest[j]) cheapest[j] = row[j], nearest[j] = i;
  }
  for (std::uint32_t j = 0; j < m; ++j) ends.emplace_back(nearest[j], j);
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return with_equal_shares(ends, n, m);
}

std::vector<Pair> pair_by_transport(const CostPair& sides, LabelMode mode) {
  // Larger problems are solved to within 1 % of the optimum, which makes no visible difference:
  // 8192 x 6144 balls then take 9 s instead of 17 s.
  constexpr std::size_t kMaxExactBalls = 2048;
  std::vector<Pair> pairs;
  for (const Subproblem& subproblem : split_by_label(sides, mode)) {
    const auto masses_of = [](const CostSide& side, const std::vector<std::uint32_t>& balls) {
      std::vector<double> masses;
      for (const std::uint32_t i : balls) masses.push_back(side.mass[i]);
      return masses;
    };
    const std::vector<double> supply = masses_of(sides.a, subproblem.from);
    const std::vector<double> demand = masses_of(sides.b, subproblem.to);
    const CostRow rows = [&](std::uint32_t from, std::span<float> costs) {
      std::vector<float> row(sides.b.size());
      cost_row(sides.a, sides.b, sides.label_cost, subproblem.from[from], row);
      for (std::size_t j = 0; j < costs.size(); ++j) costs[j] = row[subproblem.to[j]];
    };
    const double gap = std::max(supply.size(), demand.size()) > kMaxExactBalls ? 0.01 : 0;
    const TransportPlan plan = solve_transport(supply, demand, rows, gap);
    // Shares are relative to the sums of the flows, so that they sum to 1 despite rounding.
    std::vector<double> from_sum(supply.size(), 0), to_sum(demand.size(), 0);
    for (const TransportFlow& flow : plan.flows) {
      from_sum[flow.from] += flow.amount;
      to_sum[flow.to] += flow.amount;
    }
    for (const TransportFlow& flow : plan.flows)
      pairs.push_back({subproblem.from[flow.from], subproblem.to[flow.to],
                       static_cast<float>(flow.amount / from_sum[flow.from]),
                       static_cast<float>(flow.amount / to_sum[flow.to])});
  }
  return drop_minor_pairs(std::move(pairs), sides.a.size(), sides.b.size());
}

void set_masses(std::vector<Pair>& pairs, std::span<const double> from,
                std::span<const double> to) {
  for (Pair& pair : pairs)
    pair.mass = (static_cast<double>(pair.from_share) * from[pair.from] +
                 static_cast<double>(pair.to_share) * to[pair.to]) /
                2;
}

std::vector<TransportFlow> list_flows(const std::vector<Pair>& pairs) {
  std::vector<TransportFlow> flows;
  for (const Pair& pair : pairs) flows.push_back({pair.from, pair.to, pair.mass});
  return flows;
}

}  // namespace polymorph
