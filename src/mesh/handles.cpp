#include "mesh/handles.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

#include "base/result.h"
#include "mesh/components.h"
#include "mesh/edges.h"
#include "mesh/fairing.h"
#include "mesh/fans.h"

namespace polymorph {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

/// First homology of the surface modulo 2. Each side (3 * triangle + k: from corner k to corner k +
/// 1 mod 3) has a bit vector. Along a loop that bounds a region of the surface, these vectors add
/// up to 0 modulo 2. A surface of genus g needs 2 g bits. Bits beyond 64 are left out; then the sum
/// is also 0 for some loops that bound no region.
class Homology {
 public:
  explicit Homology(const Mesh& mesh)
      : mesh_(mesh),
        fans_(mesh.positions.size(), mesh.triangles),
        mate_(3 * mesh.triangles.size()),
        bits_(3 * mesh.triangles.size(), 0) {
    const std::vector<EdgeUse> uses = sorted_edge_uses(mesh.triangles);
    PM_CHECK(uses.size() == mate_.size());
    for (std::size_t i = 0; i + 1 < uses.size(); i += 2) {
      PM_CHECK(uses[i].low == uses[i + 1].low && uses[i].high == uses[i + 1].high);
      mate_[uses[i].corner] = uses[i + 1].corner;
      mate_[uses[i + 1].corner] = uses[i].corner;
    }
    std::vector<std::uint8_t> in_tree(mate_.size(), 0);
    span_vertices(in_tree);
    span_triangles(in_tree);
  }

  /// Vertices at which the side begins and ends.
  std::uint32_t from(std::uint32_t side) const { return mesh_.triangles[side / 3].v[side % 3]; }
  std::uint32_t to(std::uint32_t side) const { return from(next_corner(side)); }
  /// Returns the same edge's side of the adjacent triangle.
  std::uint32_t mate(std::uint32_t side) const { return mate_[side]; }
  std::uint64_t bits(std::uint32_t side) const { return bits_[side]; }
  float length(std::uint32_t side) const {
    return polymorph::length(mesh_.positions[to(side)] - mesh_.positions[from(side)]);
  }
  /// Calls f(side) for the sides that begin at the vertex.
  template <class F>
  void for_sides(std::uint32_t vertex, const F& f) const {
    for (const std::uint32_t t : fans_.around(vertex))
      for (std::uint32_t k = 0; k < 3; ++k)
        if (mesh_.triangles[t].v[k] == vertex) f(3 * t + k);
  }

 private:
  /// Marks the sides of a spanning tree of the vertices.
  void span_vertices(std::vector<std::uint8_t>& in_tree) const {
    std::vector<std::uint8_t> is_visited(mesh_.positions.size(), 0);
    std::vector<std::uint32_t> queue;
    for (std::uint32_t root = 0; root < is_visited.size(); ++root) {
      if (is_visited[root]) continue;
      is_visited[root] = 1;
      queue.assign(1, root);
      for (std::size_t i = 0; i < queue.size(); ++i)
        for_sides(queue[i], [&](std::uint32_t side) {
          const std::uint32_t next = to(side);
          if (is_visited[next]) return;
          is_visited[next] = 1;
          in_tree[side] = in_tree[mate_[side]] = 1;
          queue.push_back(next);
        });
    }
  }

  /// Builds a spanning tree of the triangles across sides that the vertex tree does not use. 2 g
  /// edges remain in neither tree: each closes a loop of triangles, and a loop of sides bounds a
  /// region of the surface if it crosses each of these loops an even number of times. Sets the bits
  /// of each side, one per loop of triangles that crosses it.
  void span_triangles(std::vector<std::uint8_t>& in_tree) {
    const std::size_t count = mesh_.triangles.size();
    // The side of the parent across which each triangle was reached.
    std::vector<std::uint32_t> entered_by(count, kNone);
    std::vector<std::uint8_t> is_visited(count, 0);
    std::vector<std::uint32_t> queue;
    for (std::uint32_t root = 0; root < count; ++root) {
      if (is_visited[root]) continue;
      is_visited[root] = 1;
      std::size_t i = queue.size();
      for (queue.push_back(root); i < queue.size(); ++i)
        for (std::uint32_t side = 3 * queue[i]; side < 3 * queue[i] + 3; ++side) {
          const std::uint32_t next = mate_[side] / 3;
          if (in_tree[side] || is_visited[next]) continue;
          is_visited[next] = 1;
          entered_by[next] = side;
          in_tree[side] = in_tree[mate_[side]] = 1;
          queue.push_back(next);
        }
    }
    // A loop of triangles crosses the side above a subtree if exactly one of its ends lies in it.
    // The reversed queue has children before their parents.
    std::vector<std::uint64_t> subtree_bits(count, 0);
    std::uint64_t bit = 1;
    for (std::uint32_t side = 0; side < in_tree.size() && bit != 0; ++side) {
      if (in_tree[side] || side > mate_[side]) continue;
      bits_[side] = bits_[mate_[side]] = bit;
      subtree_bits[side / 3] ^= bit;
      subtree_bits[mate_[side] / 3] ^= bit;
      bit <<= 1;
    }
    for (std::size_t i = queue.size(); i-- > 0;) {
      const std::uint32_t side = entered_by[queue[i]];
      if (side == kNone) continue;
      bits_[side] = bits_[mate_[side]] = subtree_bits[queue[i]];
      subtree_bits[side / 3] ^= subtree_bits[queue[i]];
    }
  }

  const Mesh& mesh_;
  Fans fans_;
  std::vector<std::uint32_t> mate_;
  std::vector<std::uint64_t> bits_;
};

/// A closed chain of sides: each side ends where the next one begins.
using Loop = std::vector<std::uint32_t>;

/// Search for the shortest loop below `max_length` that bounds no region of the surface. Decrements
/// `steps` whenever it sets the label of a vertex.
class LoopSearch {
 public:
  LoopSearch(const Homology& homology, std::size_t vertices, float max_length, std::int64_t& steps)
      : homology_(homology),
        labels_(vertices),
        finished_(vertices, 0),
        best_(max_length),
        steps_(steps) {}

  /// Returns the shortest loop found before `steps` ran out; empty if none was found.
  Loop find(std::size_t sides) {
    // A loop that bounds no region contains a side whose bits are not 0.
    for (std::uint32_t side = 0; side < sides && steps_ > 0; ++side) {
      const std::uint32_t seed = homology_.from(side);
      if (homology_.bits(side) == 0 || finished_[seed]) continue;
      search_from(seed);
      finished_[seed] = 1;  // no loop through this vertex is shorter than the best one
    }
    return std::move(loop_);
  }

 private:
  struct Label {
    float distance = std::numeric_limits<float>::infinity();
    std::uint64_t bits = 0;
    std::uint32_t side = kNone;  ///< last side of the path to the vertex; kNone at the seed
  };

  /// Runs Dijkstra's algorithm. Two paths to a vertex form a loop; if their bits differ, it bounds
  /// no region.
  void search_from(std::uint32_t seed) {
    using Entry = std::pair<float, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    labels_[seed] = {0, 0, kNone};
    touched_.push_back(seed);
    queue.emplace(0.0f, seed);
    while (!queue.empty()) {
      const float distance = queue.top().first;
      const std::uint32_t u = queue.top().second;
      queue.pop();
      if (2 * distance >= best_) break;  // loops found from here on are not shorter
      if (distance > labels_[u].distance) continue;
      homology_.for_sides(u, [&](std::uint32_t side) {
        const std::uint32_t w = homology_.to(side);
        if (finished_[w]) return;
        Label& label = labels_[w];
        const float length = distance + homology_.length(side);
        const std::uint64_t bits = labels_[u].bits ^ homology_.bits(side);
        if (bits != label.bits && length + label.distance < best_) {
          best_ = length + label.distance;
          loop_ = loop_through(side);
        }
        if (length >= label.distance) return;
        if (label.side == kNone && w != seed) touched_.push_back(w);
        label = {length, bits, side};
        queue.emplace(length, w);
        --steps_;
      });
    }
    for (const std::uint32_t v : touched_) labels_[v] = {};
    touched_.clear();
  }

  /// Makes the loop that consists of the side and of the paths from the seed to its two ends,
  /// without the part that these paths share.
  Loop loop_through(std::uint32_t side) const {
    const auto path_to = [&](std::uint32_t v) {
      Loop path;
      for (; labels_[v].side != kNone; v = homology_.from(labels_[v].side))
        path.push_back(labels_[v].side);
      return path;  // from v back to the seed
    };
    Loop forward = path_to(homology_.from(side)), back = path_to(homology_.to(side));
    while (!forward.empty() && !back.empty() && forward.back() == back.back())
      forward.pop_back(), back.pop_back();
    Loop loop(forward.rbegin(), forward.rend());
    loop.push_back(side);
    for (const std::uint32_t s : back) loop.push_back(homology_.mate(s));
    return loop;
  }

  const Homology& homology_;
  std::vector<Label> labels_;
  std::vector<std::uint8_t> finished_;  ///< per vertex: all loops through it have been tried
  std::vector<std::uint32_t> touched_;  ///< vertices whose labels are set
  float best_;                          ///< length of loop_; at first `max_length`
  std::int64_t& steps_;
  Loop loop_;  ///< the shortest loop found; empty: none yet
};

/// Cuts the surface along the loop and closes both sides by fans. The triangles to the right of the
/// loop keep its vertices; those to the left get copies of them.
void cut(Mesh& mesh, const Homology& homology, const Loop& loop) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> reassigned;  // a corner, its new vertex
  std::vector<std::uint32_t> right, left;  // vertices of the two boundaries, along the loop
  Vec3 center;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const std::uint32_t v = homology.from(loop[i]);
    const std::uint32_t previous = loop[(i + loop.size() - 1) % loop.size()];
    right.push_back(v);
    left.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
    center = center + mesh.positions[v] * (1 / static_cast<float>(loop.size()));
    // The corners at v to the left of the loop, counter-clockwise from its next side.
    for (std::uint32_t side = loop[i];;) {
      reassigned.emplace_back(side, left.back());
      const std::uint32_t side_to_v = next_corner(next_corner(side));
      if (side_to_v == previous) break;
      side = homology.mate(side_to_v);
      PM_CHECK(side != loop[i]);
    }
    mesh.positions.push_back(mesh.positions[v]);
    if (!mesh.normals.empty()) mesh.normals.push_back(mesh.normals[v]);
  }
  for (const auto& [corner, vertex] : reassigned) mesh.triangles[corner / 3].v[corner % 3] = vertex;
  std::vector<std::uint32_t> changed = right;
  changed.insert(changed.end(), left.begin(), left.end());
  std::reverse(left.begin(), left.end());  // caps run against the adjacent triangles' sides
  for (const std::vector<std::uint32_t>* boundary : {&right, &left}) {
    const auto center_vertex = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(center);
    if (!mesh.normals.empty()) mesh.normals.push_back({});
    changed.push_back(center_vertex);
    for (std::size_t i = 0; i < boundary->size(); ++i)
      mesh.triangles.push_back(
          {{(*boundary)[i], (*boundary)[(i + 1) % boundary->size()], center_vertex}});
  }
  constexpr int kFairingSteps = 24;
  fair(mesh, changed, kFairingSteps);
}

}  // namespace

std::int64_t compute_genus(const Mesh& mesh) {
  const auto components = static_cast<std::int64_t>(count_components(mesh));
  // V - E + F = 2 components - 2 genus, and 2 E = 3 F.
  return components - (2 * static_cast<std::int64_t>(mesh.positions.size()) -
                       static_cast<std::int64_t>(mesh.triangles.size())) /
                          4;
}

std::size_t cut_handles(Mesh& mesh, std::int64_t genus, float max_length) {
  constexpr std::int64_t kMaxSteps = 5'000'000;
  std::int64_t steps = kMaxSteps;
  std::size_t cuts = 0;
  for (std::int64_t excess = compute_genus(mesh) - genus; excess > 0; --excess, ++cuts) {
    const Homology homology(mesh);
    Loop loop;
    // Short loops are found within small disks, so a small limit is tried first: it is much faster.
    for (float limit = max_length / 8; loop.empty() && limit <= max_length; limit *= 2)
      loop =
          LoopSearch(homology, mesh.positions.size(), limit, steps).find(3 * mesh.triangles.size());
    if (loop.empty()) break;
    cut(mesh, homology, loop);
  }
  return cuts;
}

}  // namespace polymorph
