// Pairs of balls by each of a plan's methods (docs/method.md, Plan).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "morph/cost.h"
#include "morph/plan.h"
#include "morph/transport.h"

namespace polymorph {

/// Both objects' balls in feature space, and the cost of pairing different labels. `a` is the
/// source, already rotated by the alignment.
struct CostPair {
  CostSide a, b;
  float label_cost = 0;
};

/// Pairs balls in list order (Gilbert 2010, 5.2.7). The surplus balls of the longer list are paired
/// with pseudo-randomly chosen balls of the shorter one.
std::vector<Pair> pair_by_index(std::size_t from_count, std::size_t to_count, std::uint64_t seed);

/// Pairs every ball of either side with the cheapest ball of the other side. A ball in several
/// pairs has an equal share in each.
std::vector<Pair> pair_nearest(const CostPair& sides);

/// Pairs balls by optimal transport of their masses. With LabelMode::kHard, the balls of each label
/// are a transport problem of their own. Pairs that carry less than 8 % of both their balls are
/// dropped, unless they are the largest pair of one of these balls.
std::vector<Pair> pair_by_transport(const CostPair& sides, LabelMode mode);

/// Sets each pair's mass: the mean of the masses that its two balls contribute. `from`, `to`: the
/// balls' masses.
void set_masses(std::vector<Pair>& pairs, std::span<const double> from, std::span<const double> to);

/// Converts pairs to flows whose amounts are the pairs' masses.
std::vector<TransportFlow> list_flows(const std::vector<Pair>& pairs);

}  // namespace polymorph
