#include "morph/features.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "base/matrix_decompositions.h"
#include "base/parallel.h"

namespace polymorph {
namespace {

constexpr std::size_t kGraphNeighbors = 8;
constexpr std::size_t kShapeNeighbors = 16;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Graph = std::vector<std::vector<std::pair<std::uint32_t, double>>>;

double distance(const std::vector<Ball>& balls, std::uint32_t i, std::uint32_t j) {
  return static_cast<double>(length(balls[i].center - balls[j].center));
}

/// Nearest neighbours that nearly touch, and the shortest links that make it one piece (Prim).
Graph ball_graph(const std::vector<Ball>& balls,
                 const std::vector<std::vector<std::uint32_t>>& neighbors) {
  const auto n = static_cast<std::uint32_t>(balls.size());
  Graph graph(n);
  const auto link = [&](std::uint32_t i, std::uint32_t j) {
    graph[i].emplace_back(j, distance(balls, i, j));
    graph[j].emplace_back(i, distance(balls, i, j));
  };
  std::vector<double> best(n, kInfinity);
  std::vector<std::uint32_t> parent(n, 0);
  std::vector<char> done(n, 0);
  std::vector<double> reach(n, 0);  // of a ball: its longest link in the tree
  std::uint32_t at = 0;
  for (std::uint32_t step = 1; step < n; ++step) {
    done[at] = 1;
    std::uint32_t next = n;
    for (std::uint32_t j = 0; j < n; ++j) {
      if (done[j]) continue;
      const double d = distance(balls, at, j);
      if (d < best[j]) best[j] = d, parent[j] = at;
      if (next == n || best[j] < best[next]) next = j;
    }
    link(next, parent[next]);
    reach[next] = std::max(reach[next], best[next]);
    reach[parent[next]] = std::max(reach[parent[next]], best[next]);
    at = next;
  }
  // Other neighbours join where the gap is like the tree's own: a graph that jumped from leg to
  // leg would make two legs one.
  constexpr double kSlack = 1.5;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < std::min(kGraphNeighbors, neighbors[i].size()); ++k) {
      const std::uint32_t j = neighbors[i][k];
      if (distance(balls, i, j) <= kSlack * std::max(reach[i], reach[j])) link(i, j);
    }
  return graph;
}

std::vector<double> distances_from(const Graph& graph, std::uint32_t start) {
  std::vector<double> distances(graph.size(), kInfinity);
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  distances[start] = 0;
  queue.emplace(0, start);
  while (!queue.empty()) {
    const auto [d, i] = queue.top();
    queue.pop();
    if (d > distances[i]) continue;
    for (const auto& [j, step] : graph[i])
      if (d + step < distances[j]) {
        distances[j] = d + step;
        queue.emplace(distances[j], j);
      }
  }
  return distances;
}

/// Mean way from each ball to everywhere, by way of a few dozen bases far from each other, each of
/// the weight of what is nearest to it.
std::vector<float> mean_distances(const Graph& graph, std::span<const double> masses) {
  constexpr std::size_t kBases = 48;
  const std::size_t n = graph.size();
  std::vector<std::vector<double>> from_base;
  std::vector<double> to_nearest(n, kInfinity);
  std::vector<std::size_t> owner(n, 0);
  auto base =
      static_cast<std::uint32_t>(std::max_element(masses.begin(), masses.end()) - masses.begin());
  while (from_base.size() < std::min(kBases, n)) {
    from_base.push_back(distances_from(graph, base));
    for (std::size_t i = 0; i < n; ++i)
      if (from_base.back()[i] < to_nearest[i])
        to_nearest[i] = from_base.back()[i], owner[i] = from_base.size() - 1;
    base = static_cast<std::uint32_t>(std::max_element(to_nearest.begin(), to_nearest.end()) -
                                      to_nearest.begin());
  }
  std::vector<double> weight(from_base.size(), 0), mean(n, 0);
  for (std::size_t i = 0; i < n; ++i) weight[owner[i]] += masses[i];
  for (std::size_t b = 0; b < from_base.size(); ++b)
    for (std::size_t i = 0; i < n; ++i) mean[i] += weight[b] * from_base[b][i];
  const double smallest = *std::min_element(mean.begin(), mean.end());
  std::vector<float> result(n, 0);
  for (std::size_t i = 0; i < n; ++i)
    result[i] = smallest > 0 ? static_cast<float>(mean[i] / smallest - 1) : 0.0f;
  return result;
}

}  // namespace

std::vector<std::vector<std::uint32_t>> nearest_neighbors(std::span<const Vec3> points,
                                                          std::size_t count) {
  std::vector<std::vector<std::uint32_t>> result(points.size());
  parallel_ranges(
      static_cast<std::int64_t>(points.size()), 16, [&](std::int64_t begin, std::int64_t end) {
        std::vector<std::pair<float, std::uint32_t>> others;
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
          others.clear();
          for (std::uint32_t j = 0; j < points.size(); ++j) {
            const Vec3 d = points[j] - points[i];
            if (j != i) others.emplace_back(dot(d, d), j);
          }
          const std::size_t kept = std::min(count, others.size());
          std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(kept),
                            others.end());
          for (std::size_t k = 0; k < kept; ++k) result[i].push_back(others[k].second);
        }
      });
  return result;
}

BallFeatures ball_features(const std::vector<Ball>& balls, std::span<const double> masses) {
  const std::size_t n = balls.size();
  std::vector<Vec3> centers(n);
  for (std::size_t i = 0; i < n; ++i) centers[i] = balls[i].center;
  const auto neighbors = nearest_neighbors(centers, kShapeNeighbors);
  BallFeatures features;
  features.distance = mean_distances(ball_graph(balls, neighbors), masses);
  features.linearity.assign(n, 0);
  features.planarity.assign(n, 0);
  features.outward.assign(n, {});
  parallel_for(static_cast<std::int64_t>(n), [&](std::int64_t index) {
    const auto i = static_cast<std::size_t>(index);
    if (neighbors[i].empty()) return;
    double total = masses[i];
    Vec3d mean = Vec3d(centers[i]) * masses[i];
    for (const std::uint32_t j : neighbors[i]) {
      total += masses[j];
      mean = mean + Vec3d(centers[j]) * masses[j];
    }
    mean = mean * (1 / total);
    Mat3 spread{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
    const auto add = [&](std::size_t j) {
      const Vec3d d = Vec3d(centers[j]) - mean;
      const double v[3] = {d.x, d.y, d.z};
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) spread.at(r, c) += masses[j] / total * v[r] * v[c];
    };
    add(i);
    for (const std::uint32_t j : neighbors[i]) add(j);
    const Axes axes = principal_axes(spread);
    if (!(axes.values[0] > 0)) return;
    features.linearity[i] = static_cast<float>((axes.values[0] - axes.values[1]) / axes.values[0]);
    features.planarity[i] = static_cast<float>((axes.values[1] - axes.values[2]) / axes.values[0]);
    features.outward[i] = to_float((Vec3d(centers[i]) - mean) *
                                   (1 / std::sqrt(spread.m[0] + spread.m[4] + spread.m[8])));
  });
  return features;
}

}  // namespace polymorph
