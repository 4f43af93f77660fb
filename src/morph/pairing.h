// Pairs of balls by each of a plan's methods (docs/method.md, Plan).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "morph/cost.h"
#include "morph/plan.h"
#include "morph/transport.h"

namespace polymorph {

/// The sides as a plan's cost sees them, `a` already turned.
struct CostPair {
  CostSide a, b;
  float label_cost = 0;
};

/// The report's correspondence (5.2.7): array order; the surplus of the longer list is paired with
/// pseudo-randomly chosen balls of the other.
std::vector<Pair> pair_by_index(std::size_t from, std::size_t to, std::uint64_t seed);

/// Pairs every ball of either side with the cheapest one of the other.
std::vector<Pair> pair_nearest(const CostPair& sides);

/// Optimal transport of the sides' masses, with hard labels one problem a label; pairs that carry
/// little of both their balls are dropped.
std::vector<Pair> pair_by_transport(const CostPair& sides, LabelMode mode);

/// Sets what each pair carries of the whole: the mean of both ends' shares of it.
void set_masses(std::vector<Pair>& pairs, std::span<const double> from, std::span<const double> to);

/// The pairs as flows of their masses.
std::vector<TransportFlow> list_flows(const std::vector<Pair>& pairs);

}  // namespace polymorph
