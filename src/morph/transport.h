// Optimal transport between two sets of masses (network simplex, LEMON).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace polymorph {

struct TransportFlow {
  std::uint32_t from = 0, to = 0;
  double amount = 0;  ///< share of a total of 1, > 0
};

struct TransportPlan {
  std::vector<TransportFlow> flows;  ///< sorted by from, then to; at most n + m - 1
  double cost = 0;                   ///< sum of amount x cost
  /// No plan is cheaper than this (linear programming's dual, exactly).
  double lower_bound = 0;
};

/// Writes the costs of one source to every target: finite, >= 0.
using CostRow = std::function<void(std::uint32_t from, std::span<float> costs)>;

/// Carries `supply` to `demand` (> 0; each is scaled to a total of 1) at the least cost: network
/// simplex on the arcs that can matter, and on more of them until no arc left out would help
/// (column generation); exact when cost = lower_bound. `gap` is the relative difference of the two
/// at which it stops. `rows` is called from several threads. Deterministic.
TransportPlan solve_transport(std::span<const double> supply, std::span<const double> demand,
                              const CostRow& rows, double gap = 0);

}  // namespace polymorph
