#include "analyze/edge_paths.h"

#include <functional>
#include <limits>
#include <queue>

#include "base/parallel.h"
#include "kernels/linear.h"
#include "mesh/edges.h"

namespace polymorph {
namespace {

/// An edge seen from one of its ends.
struct Link {
  std::uint32_t to = 0;  ///< the other end
  double length = 0;
};
/// The edges at each point: those of point v are links[first[v]] to links[first[v + 1] - 1].
struct EdgeGraph {
  std::vector<std::size_t> first;
  std::vector<Link> links;
};

/// Makes the graph by a counting sort: counts the edges at each point, then places them.
EdgeGraph make_graph(MeshView mesh) {
  const std::vector<EdgeUse> uses = sorted_edge_uses(mesh.triangles);
  EdgeGraph graph;
  graph.first.assign(mesh.points.size() + 1, 0);
  for_each_edge(uses, [&](std::size_t use, std::size_t) {
    ++graph.first[uses[use].low + 1];
    ++graph.first[uses[use].high + 1];
  });
  for (std::size_t v = 1; v < graph.first.size(); ++v) graph.first[v] += graph.first[v - 1];
  std::vector<std::size_t> next(graph.first.begin(), graph.first.end() - 1);
  graph.links.resize(graph.first.back());
  for_each_edge(uses, [&](std::size_t use, std::size_t) {
    const std::uint32_t a = uses[use].low, b = uses[use].high;
    const double length_ab = length(Vec3d(mesh.points[a]) - Vec3d(mesh.points[b]));
    graph.links[next[a]++] = {b, length_ab};
    graph.links[next[b]++] = {a, length_ab};
  });
  return graph;
}

/// Returns the length of the shortest path (Dijkstra's algorithm); infinite if there is none.
double shortest_path_length(const EdgeGraph& graph, std::uint32_t from, std::uint32_t to) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<double> distance(graph.first.size() - 1, kInfinity);
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  distance[from] = 0;
  queue.emplace(0, from);
  while (!queue.empty()) {
    const auto [distance_to_v, v] = queue.top();
    queue.pop();
    if (v == to) return distance_to_v;
    if (distance_to_v > distance[v]) continue;  // a shorter path to v was found since
    for (std::size_t k = graph.first[v]; k < graph.first[v + 1]; ++k) {
      const Link& link = graph.links[k];
      if (!(distance_to_v + link.length < distance[link.to])) continue;
      distance[link.to] = distance_to_v + link.length;
      queue.emplace(distance[link.to], link.to);
    }
  }
  return kInfinity;
}

}  // namespace

std::vector<double> edge_path_lengths(
    MeshView mesh, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
  const EdgeGraph graph = make_graph(mesh);
  std::vector<double> lengths(pairs.size());
  parallel_for(static_cast<std::int64_t>(pairs.size()), [&](std::int64_t i) {
    const auto& [from, to] = pairs[static_cast<std::size_t>(i)];
    lengths[static_cast<std::size_t>(i)] = shortest_path_length(graph, from, to);
  });
  return lengths;
}

}  // namespace polymorph
