#include "morph/features.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "base/matrix_decompositions.h"
#include "base/parallel.h"
#include "base/procrustes.h"
#include "morph/farthest_points.h"

namespace polymorph {
namespace {

/// Number of a ball's nearest neighbours that the graph may link to it, and number of those that
/// form its neighbourhood (BallFeatures).
constexpr std::size_t kGraphNeighbors = 8;
constexpr std::size_t kShapeNeighbors = 16;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Per ball, the balls linked to it and their distances.
using Graph = std::vector<std::vector<std::pair<std::uint32_t, double>>>;

double distance(const std::vector<Ball>& balls, std::uint32_t i, std::uint32_t j) {
  return static_cast<double>(length(balls[i].center - balls[j].center));
}

/// Links each ball to its near neighbours. The links of a minimum spanning tree (Prim) are added,
/// so that all balls are connected.
Graph ball_graph(const std::vector<Ball>& balls,
                 const std::vector<std::vector<std::uint32_t>>& neighbors) {
  const auto n = static_cast<std::uint32_t>(balls.size());
  Graph graph(n);
  const auto link = [&](std::uint32_t i, std::uint32_t j) {
    graph[i].emplace_back(j, distance(balls, i, j));
    graph[j].emplace_back(i, distance(balls, i, j));
  };
  std::vector<double> distance_to_tree(n, kInfinity);
  std::vector<std::uint32_t> parent(n, 0);
  std::vector<char> in_tree(n, 0);
  std::vector<double> longest_link(n, 0);  // per ball, in the tree
  std::uint32_t current = 0;
  for (std::uint32_t step = 1; step < n; ++step) {
    in_tree[current] = 1;
    std::uint32_t next = n;
    for (std::uint32_t j = 0; j < n; ++j) {
      if (in_tree[j]) continue;
      const double d = distance(balls, current, j);
      if (d < distance_to_tree[j]) distance_to_tree[j] = d, parent[j] = current;
      if (next == n || distance_to_tree[j] < distance_to_tree[next]) next = j;
    }
    link(next, parent[next]);
    longest_link[next] = std::max(longest_link[next], distance_to_tree[next]);
    longest_link[parent[next]] = std::max(longest_link[parent[next]], distance_to_tree[next]);
    current = next;
  }
  // Other neighbours are linked only if they are not much farther than the links of the tree. Links
  // between two legs would make them one limb.
  constexpr double kSlack = 1.5;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < std::min(kGraphNeighbors, neighbors[i].size()); ++k) {
      const std::uint32_t j = neighbors[i][k];
      if (distance(balls, i, j) <= kSlack * std::max(longest_link[i], longest_link[j])) link(i, j);
    }
  return graph;
}

/// Computes the shortest paths from ball `start` to all balls (Dijkstra).
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

/// Computes BallFeatures::distance. The mean geodesic distance from each ball to all others is
/// estimated from 48 bases (farthest point sampling). A base has the mass of the balls nearest to
/// it.
std::vector<float> mean_distances(const Graph& graph, std::span<const double> masses) {
  constexpr std::size_t kBases = 48;
  const std::size_t n = graph.size();
  const auto heaviest =
      static_cast<std::uint32_t>(std::max_element(masses.begin(), masses.end()) - masses.begin());
  const auto sample = farthest_points(
      masses, kBases, heaviest, [&](std::uint32_t base) { return distances_from(graph, base); });
  std::vector<double> mean(n);
  for (std::size_t i = 0; i < n; ++i) mean[i] = sample.sum_distances(i);
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
      static_cast<std::int64_t>(points.size()), /*grain=*/16,
      [&](std::int64_t begin, std::int64_t end) {
        std::vector<std::pair<float, std::uint32_t>> others;  // squared distance, index
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
          others.clear();
          for (std::uint32_t j = 0; j < points.size(); ++j) {
            const Vec3 d = points[j] - points[i];
            if (j != i) others.emplace_back(dot(d, d), j);
          }
          const std::size_t neighbor_count = std::min(count, others.size());
          std::partial_sort(others.begin(),
                            others.begin() + static_cast<std::ptrdiff_t>(neighbor_count),
                            others.end());
          for (std::size_t k = 0; k < neighbor_count; ++k) result[i].push_back(others[k].second);
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
    if (neighbors[i].empty()) return;  // the object is a single ball
    // The centroid of the neighbourhood and the covariance about it.
    double total_mass = masses[i];
    Vec3d mean = Vec3d(centers[i]) * masses[i];
    for (const std::uint32_t j : neighbors[i]) {
      total_mass += masses[j];
      mean = mean + Vec3d(centers[j]) * masses[j];
    }
    mean = mean * (1 / total_mass);
    Mat3 covariance{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
    const auto add_ball = [&](std::size_t j) {
      const Vec3d d = Vec3d(centers[j]) - mean;
      add_outer_product(covariance, masses[j] / total_mass, d, d);
    };
    add_ball(i);
    for (const std::uint32_t j : neighbors[i]) add_ball(j);
    const EigenDecomposition axes = principal_axes(covariance);
    if (!(axes.values[0] > 0)) return;  // all centres coincide
    features.linearity[i] = static_cast<float>((axes.values[0] - axes.values[1]) / axes.values[0]);
    features.planarity[i] = static_cast<float>((axes.values[1] - axes.values[2]) / axes.values[0]);
    // The trace of the covariance is the squared RMS radius.
    features.outward[i] =
        to_float((Vec3d(centers[i]) - mean) *
                 (1 / std::sqrt(covariance.m[0] + covariance.m[4] + covariance.m[8])));
  });
  return features;
}

}  // namespace polymorph
