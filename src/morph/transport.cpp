#include "morph/transport.h"

#define LEMON_ONLY_TEMPLATES
#include <lemon/network_simplex.h>
#include <lemon/static_graph.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/parallel.h"
#include "base/result.h"

namespace polymorph {
namespace {

// A plan's cost is below 2^60, even if all mass goes through the hub (ColumnGeneration::solve()).
constexpr std::int64_t kTotal = std::int64_t{1} << 30;  ///< total mass in integer units
constexpr double kCostSteps = 1 << 26;                  ///< integer cost of the most expensive arc

/// Rounds masses to integers >= 1 that sum to kTotal (largest remainder method, ties by index).
std::vector<std::int64_t> to_units(std::span<const double> masses) {
  const double sum = std::accumulate(masses.begin(), masses.end(), 0.0);
  const auto distributed = static_cast<double>(kTotal - static_cast<std::int64_t>(masses.size()));
  std::vector<std::int64_t> units(masses.size());
  std::vector<std::pair<double, std::size_t>> remainders(masses.size());
  std::int64_t assigned = 0;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    PM_CHECK(masses[i] > 0);
    const double exact = distributed * masses[i] / sum;
    units[i] = 1 + static_cast<std::int64_t>(exact);
    remainders[i] = {std::floor(exact) - exact, i};  // negative, so that the largest sorts first
    assigned += units[i];
  }
  std::sort(remainders.begin(), remainders.end());
  for (std::size_t k = 0; assigned < kTotal; ++k, ++assigned)
    ++units[remainders[k % remainders.size()].second];
  return units;
}

/// A source, a target, and the integer cost of a unit of mass between them.
struct TransportArc {
  std::uint32_t from = 0, to = 0;
  std::int64_t cost = 0;
  friend bool operator<(const TransportArc& a, const TransportArc& b) {
    return std::pair(a.from, a.to) < std::pair(b.from, b.to);
  }
};

/// parallel_ranges(), but on the caller's thread if `work`, the number of costs, is small:
/// alignment already solves hundreds of small problems in parallel.
template <class F>
void for_ranges(std::int64_t n, std::int64_t grain, std::int64_t work, const F& f) {
  constexpr std::int64_t kMinParallelWork = 1 << 16;
  if (work < kMinParallelWork)
    f(std::int64_t{0}, n);
  else
    parallel_ranges(n, grain, f);
}

/// Solver of one transport problem, in integers. The reduced cost of an arc is its cost plus the
/// potential of its source, minus the potential of its target. It is negative for an arc that would
/// lower the plan's cost.
class ColumnGeneration {
 public:
  ColumnGeneration(std::span<const double> supply, std::span<const double> demand,
                   const CostRow& rows)
      : supply_(to_units(supply)),
        demand_(to_units(demand)),
        n_(static_cast<std::uint32_t>(supply.size())),
        m_(static_cast<std::uint32_t>(demand.size())),
        rows_(rows),
        potential_from_(n_, 0),
        potential_to_(m_, 0) {
    find_scale();
  }

  /// Alternates between solve() on the arcs so far and a search for arcs of negative reduced cost.
  TransportPlan run(double gap) {
    constexpr int kMaxRounds = 60;
    // Small problems, of which alignment solves hundreds, are faster with all arcs than with a
    // search.
    constexpr std::uint32_t kMaxDenseSize = 128;
    if (n_ + m_ <= kMaxDenseSize) {
      arcs_ = all_arcs();
      solve();
      PM_CHECK(hub_flow_ == 0);
      const double cost = cost_ / kTotal / scale_;
      return {std::move(flows_), cost, cost};
    }
    guess_potentials();
    add(cheapest_arcs(kFirstArcs, /*include_all=*/true));
    for (int round = 0;; ++round) {
      solve();
      const std::vector<TransportArc> missing = cheapest_arcs(kMoreArcs, /*include_all=*/false);
      // The dual is feasible once each source's potential is lowered by its most negative reduced
      // cost.
      const double bound = cost_ - saving_;
      if (missing.empty() || round == kMaxRounds || cost_ - bound <= gap * cost_) {
        PM_CHECK(missing.empty() || hub_flow_ == 0);
        TransportPlan plan{std::move(flows_), /*cost=*/0, bound / kTotal / scale_};
        plan.cost = cost_ / kTotal / scale_;
        return plan;
      }
      add(missing);
    }
  }

 private:
  /// Number of arcs per source and per target: at the start, and at most added per round.
  static constexpr std::size_t kFirstArcs = 12, kMoreArcs = 6;

  std::int64_t pairs() const { return std::int64_t{n_} * m_; }
  std::int64_t to_integer(float cost) const {
    return static_cast<std::int64_t>(std::llround(static_cast<double>(cost) * scale_));
  }

  /// Sets the scale that makes kCostSteps the integer cost of the most expensive arc.
  void find_scale() {
    std::vector<float> largest(n_);
    for_ranges(n_, /*grain=*/16, pairs(), [&](std::int64_t begin, std::int64_t end) {
      std::vector<float> row(m_);
      for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
        rows_(static_cast<std::uint32_t>(i), row);
        largest[i] = *std::max_element(row.begin(), row.end());
      }
    });
    const float max_cost = *std::max_element(largest.begin(), largest.end());
    PM_CHECK(std::isfinite(max_cost));
    scale_ = max_cost > 0 ? kCostSteps / static_cast<double>(max_cost) : 1;
  }

  std::vector<TransportArc> all_arcs() const {
    std::vector<TransportArc> arcs;
    std::vector<float> row(m_);
    for (std::uint32_t i = 0; i < n_; ++i) {
      rows_(i, row);
      for (std::uint32_t j = 0; j < m_; ++j) arcs.push_back({i, j, to_integer(row[j])});
    }
    return arcs;
  }

  /// Finds the `count` arcs of least reduced cost of each source and of each target. Arcs of
  /// reduced cost >= 0 are omitted unless `include_all`. Sets `saving_` to minus the sum over
  /// sources of supply times the most negative reduced cost.
  std::vector<TransportArc> cheapest_arcs(std::size_t count, bool include_all) {
    struct Candidate {
      std::int64_t reduced;  // reduced cost
      std::uint32_t other;   // the target of a source, or the source of a target
      std::int64_t cost;
      bool operator<(const Candidate& c) const {
        return std::pair(reduced, other) < std::pair(c.reduced, c.other);
      }
    };
    // Scan the costs in chunks of sources. Each chunk lists the best arcs of its sources, and the
    // best arcs from them to every target.
    constexpr std::int64_t kChunk = 128;  // fixed, so that results do not depend on threads
    const std::int64_t chunks = (n_ + kChunk - 1) / kChunk;
    std::vector<std::vector<Candidate>> by_source(n_);
    std::vector<std::vector<std::vector<Candidate>>> by_target(
        static_cast<std::size_t>(chunks), std::vector<std::vector<Candidate>>(m_));
    std::vector<std::int64_t> most_negative(n_, 0);
    const auto insert_candidate = [&](std::vector<Candidate>& best, const Candidate& candidate) {
      if (best.size() == count && !(candidate < best.back())) return;
      if (best.size() == count) best.pop_back();
      best.insert(std::upper_bound(best.begin(), best.end(), candidate), candidate);
    };
    const auto scan = [&](std::int64_t chunk) {
      std::vector<float> row(m_);
      auto& targets = by_target[static_cast<std::size_t>(chunk)];
      for (std::int64_t i = chunk * kChunk; i < std::min<std::int64_t>(n_, (chunk + 1) * kChunk);
           ++i) {
        const auto from = static_cast<std::uint32_t>(i);
        rows_(from, row);
        for (std::uint32_t to = 0; to < m_; ++to) {
          const std::int64_t cost = to_integer(row[to]);
          const std::int64_t reduced = cost + potential_from_[from] - potential_to_[to];
          if (!include_all && reduced >= 0) continue;
          most_negative[from] = std::min(most_negative[from], reduced);
          insert_candidate(by_source[from], {reduced, to, cost});
          insert_candidate(targets[to], {reduced, from, cost});
        }
      }
    };
    for_ranges(chunks, /*grain=*/1, pairs(), [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t chunk = begin; chunk < end; ++chunk) scan(chunk);
    });
    // Collect the sources' arcs, and join the chunks' lists of each target.
    std::vector<TransportArc> arcs;
    saving_ = 0;
    for (std::uint32_t i = 0; i < n_; ++i) {
      saving_ -= static_cast<double>(most_negative[i]) * static_cast<double>(supply_[i]);
      for (const Candidate& c : by_source[i]) arcs.push_back({i, c.other, c.cost});
    }
    for (std::uint32_t j = 0; j < m_; ++j) {
      std::vector<Candidate> best;
      for (const auto& targets : by_target)
        for (const Candidate& c : targets[j]) insert_candidate(best, c);
      for (const Candidate& c : best) arcs.push_back({c.other, j, c.cost});
    }
    return arcs;
  }

  /// Initializes the potentials from the potentials of a smaller problem with every k-th source and
  /// target. Arcs of low reduced cost are then mostly the ones needed. With potentials of 0, 4096 x
  /// 3079 balls take 3.4 s instead of 2.4 s.
  void guess_potentials() {
    constexpr std::uint32_t kReducedSize = 512;
    if (std::max(n_, m_) <= 2 * kReducedSize) return;
    // Solve the smaller problem.
    const std::uint32_t step_from = (n_ + kReducedSize - 1) / kReducedSize;
    const std::uint32_t step_to = (m_ + kReducedSize - 1) / kReducedSize;
    std::vector<double> supply, demand;
    for (std::uint32_t i = 0; i < n_; i += step_from)
      supply.push_back(static_cast<double>(supply_[i]));
    for (std::uint32_t j = 0; j < m_; j += step_to)
      demand.push_back(static_cast<double>(demand_[j]));
    const CostRow rows = [&](std::uint32_t from, std::span<float> costs) {
      std::vector<float> row(m_);
      rows_(from * step_from, row);
      for (std::size_t j = 0; j < costs.size(); ++j) costs[j] = row[j * step_to];
    };
    ColumnGeneration small_problem(supply, demand, rows);
    small_problem.run(/*gap=*/0.001);
    // A target gets the highest potential that leaves no negative reduced cost with the small
    // problem's sources; then a source gets the lowest that leaves none with any target.
    const double cost_ratio = scale_ / small_problem.scale_;
    std::vector<float> row(m_);
    potential_to_.assign(m_, std::numeric_limits<std::int64_t>::max());
    for (std::uint32_t k = 0; k < small_problem.n_; ++k) {
      rows_(k * step_from, row);
      const std::int64_t potential =
          std::llround(static_cast<double>(small_problem.potential_from_[k]) * cost_ratio);
      for (std::uint32_t j = 0; j < m_; ++j)
        potential_to_[j] = std::min(potential_to_[j], to_integer(row[j]) + potential);
    }
    for_ranges(n_, /*grain=*/16, pairs(), [&](std::int64_t begin, std::int64_t end) {
      std::vector<float> costs(m_);
      for (auto i = static_cast<std::uint32_t>(begin); i < static_cast<std::uint32_t>(end); ++i) {
        rows_(i, costs);
        std::int64_t potential = std::numeric_limits<std::int64_t>::min();
        for (std::uint32_t j = 0; j < m_; ++j)
          potential = std::max(potential, potential_to_[j] - to_integer(costs[j]));
        potential_from_[i] = potential;
      }
    });
  }

  /// Adds arcs; keeps them sorted and without duplicates.
  void add(std::vector<TransportArc> more) {
    arcs_.insert(arcs_.end(), more.begin(), more.end());
    std::sort(arcs_.begin(), arcs_.end());
    arcs_.erase(std::unique(arcs_.begin(), arcs_.end(),
                            [](const TransportArc& a, const TransportArc& b) {
                              return !(a < b) && !(b < a);
                            }),
                arcs_.end());
  }

  /// Runs the network simplex on the arcs found so far. Every source and target is also connected
  /// to a hub by arcs that cost more than any other, so that the problem is always feasible.
  void solve() {
    using Graph = lemon::StaticDigraph;
    const int hub = static_cast<int>(n_ + m_);
    const auto hub_cost = static_cast<std::int64_t>(2 * kCostSteps);
    // List the arcs: nodes 0 to n - 1 are the sources, then come the targets and the hub.
    std::vector<std::pair<int, int>> ends;
    std::vector<std::int64_t> costs;
    std::size_t next = 0;
    // StaticDigraph takes arcs in the order of their sources.
    for (std::uint32_t i = 0; i < n_; ++i) {
      for (; next < arcs_.size() && arcs_[next].from == i; ++next) {
        ends.emplace_back(static_cast<int>(i), static_cast<int>(n_ + arcs_[next].to));
        costs.push_back(arcs_[next].cost);
      }
      ends.emplace_back(static_cast<int>(i), hub);
      costs.push_back(hub_cost);
    }
    for (std::uint32_t j = 0; j < m_; ++j) {
      ends.emplace_back(hub, static_cast<int>(n_ + j));
      costs.push_back(hub_cost);
    }
    // Build the graph and run the simplex.
    Graph graph;
    graph.build(hub + 1, ends.begin(), ends.end());
    Graph::ArcMap<std::int64_t> cost_map(graph);
    Graph::NodeMap<std::int64_t> supply_map(graph, 0);
    for (std::size_t k = 0; k < costs.size(); ++k)
      cost_map[Graph::arc(static_cast<int>(k))] = costs[k];
    for (std::uint32_t i = 0; i < n_; ++i)
      supply_map[Graph::node(static_cast<int>(i))] = supply_[i];
    for (std::uint32_t j = 0; j < m_; ++j)
      supply_map[Graph::node(static_cast<int>(n_ + j))] = -demand_[j];
    lemon::NetworkSimplex<Graph, std::int64_t, std::int64_t> simplex(graph);
    simplex.costMap(cost_map).supplyMap(supply_map);
    const auto outcome = simplex.run();
    PM_CHECK(outcome == simplex.OPTIMAL);
    // Read potentials, flows and cost.
    for (std::uint32_t i = 0; i < n_; ++i)
      potential_from_[i] = simplex.potential(Graph::node(static_cast<int>(i)));
    for (std::uint32_t j = 0; j < m_; ++j)
      potential_to_[j] = simplex.potential(Graph::node(static_cast<int>(n_ + j)));
    flows_.clear();
    cost_ = 0;
    hub_flow_ = 0;
    for (std::size_t k = 0; k < ends.size(); ++k) {
      const std::int64_t amount = simplex.flow(Graph::arc(static_cast<int>(k)));
      if (amount == 0) continue;
      cost_ += static_cast<double>(amount) * static_cast<double>(costs[k]);
      if (ends[k].first == hub || ends[k].second == hub) {
        hub_flow_ += amount;
        continue;
      }
      flows_.push_back({static_cast<std::uint32_t>(ends[k].first),
                        static_cast<std::uint32_t>(ends[k].second) - n_,
                        static_cast<double>(amount) / static_cast<double>(kTotal)});
    }
  }

  std::vector<std::int64_t> supply_, demand_;
  std::uint32_t n_, m_;
  const CostRow& rows_;
  double scale_ = 1;  ///< integer cost per unit of cost
  std::vector<TransportArc> arcs_;
  std::vector<std::int64_t> potential_from_, potential_to_;  ///< dual variables
  std::vector<TransportFlow> flows_;
  /// Cost of `flows_`, and the most by which other arcs may lower it (cheapest_arcs()), in integer
  /// units.
  double cost_ = 0, saving_ = 0;
  std::int64_t hub_flow_ = 0;  ///< mass for which solve() found no arcs but the hub's
};

}  // namespace

TransportPlan solve_transport(std::span<const double> supply, std::span<const double> demand,
                              const CostRow& rows, double gap) {
  PM_CHECK(!supply.empty() && !demand.empty());
  return ColumnGeneration(supply, demand, rows).run(gap);
}

}  // namespace polymorph
