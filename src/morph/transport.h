// Optimal transport between two sets of masses (network simplex, LEMON).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace polymorph {

/// Mass that is moved from one source to one target, which are given by their indices.
struct TransportFlow {
  std::uint32_t from = 0, to = 0;
  double amount = 0;  ///< > 0; the amounts of all flows sum to 1
};

/// A transport plan and its cost.
struct TransportPlan {
  std::vector<TransportFlow> flows;  ///< sorted by `from`, then `to`
  double cost = 0;                   ///< sum over the flows of amount * cost of the arc
  /// Lower bound of the cost of any plan, from the dual of the linear programme.
  double lower_bound = 0;
};

/// Writes the costs of one source to every target: finite, >= 0.
using CostRow = std::function<void(std::uint32_t from, std::span<float> costs)>;

/// Finds the cheapest plan from the sources' masses `supply` to the targets' masses `demand`, all >
/// 0; each side is scaled to a sum of 1. Uses column generation: the network simplex runs on the
/// arcs (pairs of source and target) that are likely to be used, then on more of them, until no
/// other arc would lower the cost. The plan is optimal if cost = lower_bound; the search stops when
/// they differ by at most the fraction `gap`. `rows` is called from several threads. Deterministic.
TransportPlan solve_transport(std::span<const double> supply, std::span<const double> demand,
                              const CostRow& rows, double gap = 0);

}  // namespace polymorph
