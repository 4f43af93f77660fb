#include "morph/transport.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "base/random.h"

namespace polymorph {
namespace {

struct Instance {
  std::vector<double> supply, demand;
  std::vector<float> costs;  ///< [from][to]
  TransportPlan solve(double gap = 0) const {
    const std::size_t m = demand.size();
    return solve_transport(
        supply, demand,
        [&](std::uint32_t from, std::span<float> row) {
          std::copy_n(costs.begin() + static_cast<std::ptrdiff_t>(from * m), m, row.begin());
        },
        gap);
  }
};

/// Points of two clouds, squared distances.
Instance clouds(std::size_t n, std::size_t m, std::uint64_t seed, bool equal = false) {
  Instance instance;
  const auto r = [&](std::uint64_t stream, std::size_t i) { return random_float(seed, stream, i); };
  for (std::size_t i = 0; i < n; ++i)
    instance.supply.push_back(equal ? 1 : 0.2 + static_cast<double>(r(0, i)));
  for (std::size_t j = 0; j < m; ++j)
    instance.demand.push_back(equal ? 1 : 0.2 + static_cast<double>(r(1, j)));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < m; ++j) {
      const float x = r(2, i) - r(5, j) * r(5, j), y = r(3, i) - r(6, j), z = r(4, i) - r(7, j);
      instance.costs.push_back(x * x + y * y + z * z);
    }
  return instance;
}

/// The optimum of an assignment of equal masses by trying every permutation.
double best_assignment(const Instance& instance) {
  const std::size_t n = instance.supply.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  double smallest = 1e30;
  do {
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i)
      sum += static_cast<double>(instance.costs[i * n + order[i]]);
    smallest = std::min(smallest, sum / static_cast<double>(n));
  } while (std::next_permutation(order.begin(), order.end()));
  return smallest;
}

TEST(Transport, FindsTheCheapestOfAllAssignments) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Instance instance = clouds(7, 7, seed, true);
    const TransportPlan plan = instance.solve();
    EXPECT_NEAR(plan.cost, best_assignment(instance), 1e-6) << seed;
  }
}

TEST(Transport, CarriesExactlyWhatIsThere) {
  for (const auto& [n, m] : {std::pair{1, 1}, {1, 9}, {9, 1}, {40, 73}, {300, 211}}) {
    const Instance instance = clouds(static_cast<std::size_t>(n), static_cast<std::size_t>(m), 5);
    const TransportPlan plan = instance.solve();
    const double supplied = std::accumulate(instance.supply.begin(), instance.supply.end(), 0.0);
    const double demanded = std::accumulate(instance.demand.begin(), instance.demand.end(), 0.0);
    std::vector<double> from(instance.supply.size()), to(instance.demand.size());
    for (const TransportFlow& flow : plan.flows) {
      EXPECT_GT(flow.amount, 0);
      from.at(flow.from) += flow.amount;
      to.at(flow.to) += flow.amount;
    }
    for (std::size_t i = 0; i < from.size(); ++i)
      EXPECT_NEAR(from[i], instance.supply[i] / supplied, 1e-6);
    for (std::size_t j = 0; j < to.size(); ++j)
      EXPECT_NEAR(to[j], instance.demand[j] / demanded, 1e-6);
    EXPECT_LE(plan.flows.size(), instance.supply.size() + instance.demand.size() - 1);
  }
}

/// The bound comes from potentials over all arcs, so equality with the cost proves the optimum.
TEST(Transport, IsProvenOptimalOnRandomInstances) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const TransportPlan plan = clouds(230 + 17 * seed, 190, seed).solve();
    EXPECT_NEAR(plan.lower_bound, plan.cost, 1e-7 * plan.cost);
  }
}

TEST(Transport, ThousandsOfBallsComeWithinOnePercentOfTheOptimum) {
  const Instance instance = clouds(1500, 1300, 3);
  const TransportPlan exact = instance.solve(), rough = instance.solve(0.01);
  EXPECT_NEAR(exact.lower_bound, exact.cost, 1e-7 * exact.cost);
  EXPECT_GE(rough.cost, exact.cost * (1 - 1e-9));
  EXPECT_LE(rough.cost, exact.cost * 1.01);
  EXPECT_LE(rough.lower_bound, exact.cost * (1 + 1e-9));
}

TEST(Transport, TheSameTwoTimes) {
  const Instance instance = clouds(600, 700, 8, true);
  const TransportPlan one = instance.solve(), two = instance.solve();
  ASSERT_EQ(one.flows.size(), two.flows.size());
  for (std::size_t k = 0; k < one.flows.size(); ++k) {
    EXPECT_EQ(one.flows[k].from, two.flows[k].from);
    EXPECT_EQ(one.flows[k].to, two.flows[k].to);
    EXPECT_EQ(one.flows[k].amount, two.flows[k].amount);
  }
}

TEST(Transport, CostsThatAreAllZeroAreNoTrouble) {
  Instance instance = clouds(20, 30, 1);
  std::fill(instance.costs.begin(), instance.costs.end(), 0.0f);
  const TransportPlan plan = instance.solve();
  EXPECT_EQ(plan.cost, 0);
  EXPECT_FALSE(plan.flows.empty());
}

}  // namespace
}  // namespace polymorph
