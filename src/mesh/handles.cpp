#include "mesh/handles.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

#include "base/disjoint_sets.h"
#include "base/result.h"
#include "mesh/edges.h"
#include "mesh/fairing.h"
#include "mesh/fans.h"

namespace polymorph {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

/// The surface's sides (3 * triangle + k: from corner k to corner k + 1), and for each a set of
/// bits: those of the sides that a loop passes along, added modulo 2, are 0 where the loop bounds a
/// part of the surface. A surface of genus g has 2 g bits; beyond 64 some are left out, and then
/// some loops are not told from such.
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
    std::vector<std::uint8_t> used(mate_.size(), 0);
    span_vertices(used);
    span_triangles(used);
  }

  std::uint32_t from(std::uint32_t side) const { return mesh_.triangles[side / 3].v[side % 3]; }
  std::uint32_t to(std::uint32_t side) const { return from(corner_after(side)); }
  std::uint32_t mate(std::uint32_t side) const { return mate_[side]; }
  std::uint64_t bits(std::uint32_t side) const { return bits_[side]; }
  float length(std::uint32_t side) const {
    return polymorph::length(mesh_.positions[to(side)] - mesh_.positions[from(side)]);
  }
  /// Calls f(side) for the sides that begin at the vertex.
  template <class F>
  void for_sides(std::uint32_t vertex, const F& f) const {
    for (const std::uint32_t t : fans_.of(vertex))
      for (std::uint32_t k = 0; k < 3; ++k)
        if (mesh_.triangles[t].v[k] == vertex) f(3 * t + k);
  }

 private:
  /// A spanning tree of the vertices.
  void span_vertices(std::vector<std::uint8_t>& used) const {
    std::vector<std::uint8_t> reached(mesh_.positions.size(), 0);
    std::vector<std::uint32_t> queue;
    for (std::uint32_t root = 0; root < reached.size(); ++root) {
      if (reached[root]) continue;
      reached[root] = 1;
      queue.assign(1, root);
      for (std::size_t i = 0; i < queue.size(); ++i)
        for_sides(queue[i], [&](std::uint32_t side) {
          const std::uint32_t next = to(side);
          if (reached[next]) return;
          reached[next] = 1;
          used[side] = used[mate_[side]] = 1;
          queue.push_back(next);
        });
    }
  }

  /// A spanning tree of the triangles, across sides that the other tree does not use. What sides
  /// are left over are 2 g: each of them closes a loop of triangles, and a loop of vertices bounds
  /// a part of the surface if it crosses each of those an even number of times.
  void span_triangles(std::vector<std::uint8_t>& used) {
    const std::size_t count = mesh_.triangles.size();
    std::vector<std::uint32_t> across(count, kNone);  // the side by which a triangle was reached
    std::vector<std::uint8_t> reached(count, 0);
    std::vector<std::uint32_t> queue;
    for (std::uint32_t root = 0; root < count; ++root) {
      if (reached[root]) continue;
      reached[root] = 1;
      std::size_t i = queue.size();
      for (queue.push_back(root); i < queue.size(); ++i)
        for (std::uint32_t side = 3 * queue[i]; side < 3 * queue[i] + 3; ++side) {
          const std::uint32_t next = mate_[side] / 3;
          if (used[side] || reached[next]) continue;
          reached[next] = 1;
          across[next] = side;
          used[side] = used[mate_[side]] = 1;
          queue.push_back(next);
        }
    }
    std::vector<std::uint64_t> odd(count, 0);  // loops that end in the part below a triangle
    std::uint64_t bit = 1;
    for (std::uint32_t side = 0; side < used.size() && bit != 0; ++side) {
      if (used[side] || side > mate_[side]) continue;
      bits_[side] = bits_[mate_[side]] = bit;
      odd[side / 3] ^= bit;
      odd[mate_[side] / 3] ^= bit;
      bit <<= 1;
    }
    for (std::size_t i = queue.size(); i-- > 0;) {
      const std::uint32_t side = across[queue[i]];
      if (side == kNone) continue;
      bits_[side] = bits_[mate_[side]] = odd[queue[i]];
      odd[side / 3] ^= odd[queue[i]];
    }
  }

  const Mesh& mesh_;
  Fans fans_;
  std::vector<std::uint32_t> mate_;
  std::vector<std::uint64_t> bits_;
};

/// Sides one after the other, the last back to the first.
using Loop = std::vector<std::uint32_t>;

/// The shortest loop below `longest` that bounds no part of the surface; empty: there is none, or
/// `steps` were not enough. Takes from `steps`, one for each vertex reached.
class LoopSearch {
 public:
  LoopSearch(const Homology& homology, std::size_t vertices, float longest, std::int64_t& steps)
      : homology_(homology),
        labels_(vertices),
        tried_(vertices, 0),
        best_(longest),
        steps_(steps) {}

  Loop run(std::size_t sides) {
    // Such a loop passes along a side with bits.
    for (std::uint32_t side = 0; side < sides && steps_ > 0; ++side) {
      const std::uint32_t seed = homology_.from(side);
      if (homology_.bits(side) == 0 || tried_[seed]) continue;
      search_from(seed);
      tried_[seed] = 1;  // no shorter loop passes through it
    }
    return std::move(loop_);
  }

 private:
  struct Label {
    float distance = std::numeric_limits<float>::infinity();
    std::uint64_t bits = 0;
    std::uint32_t side = kNone;  ///< by which it is reached
  };

  /// Dijkstra's algorithm. Two ways to a vertex make a loop.
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
      if (2 * distance >= best_) break;
      if (distance > labels_[u].distance) continue;
      homology_.for_sides(u, [&](std::uint32_t side) {
        const std::uint32_t w = homology_.to(side);
        if (tried_[w]) return;
        Label& label = labels_[w];
        const float way = distance + homology_.length(side);
        const std::uint64_t bits = labels_[u].bits ^ homology_.bits(side);
        if (bits != label.bits && way + label.distance < best_) {
          best_ = way + label.distance;
          loop_ = loop_through(side);
        }
        if (way >= label.distance) return;
        if (label.side == kNone && w != seed) touched_.push_back(w);
        label = {way, bits, side};
        queue.emplace(way, w);
        --steps_;
      });
    }
    for (const std::uint32_t v : touched_) labels_[v] = {};
    touched_.clear();
  }

  /// Along the side from the vertex where the ways to its ends part, and back to there.
  Loop loop_through(std::uint32_t side) const {
    const auto way_to = [&](std::uint32_t v) {
      Loop way;
      for (; labels_[v].side != kNone; v = homology_.from(labels_[v].side))
        way.push_back(labels_[v].side);
      return way;  // from v back to the seed
    };
    Loop there = way_to(homology_.from(side)), back = way_to(homology_.to(side));
    while (!there.empty() && !back.empty() && there.back() == back.back())
      there.pop_back(), back.pop_back();
    Loop loop(there.rbegin(), there.rend());
    loop.push_back(side);
    for (const std::uint32_t s : back) loop.push_back(homology_.mate(s));
    return loop;
  }

  const Homology& homology_;
  std::vector<Label> labels_;
  std::vector<std::uint8_t> tried_;
  std::vector<std::uint32_t> touched_;
  float best_;
  std::int64_t& steps_;
  Loop loop_;
};

/// Cuts the surface along the loop and closes both sides.
void cut(Mesh& mesh, const Homology& homology, const Loop& loop) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> renamed;  // corner, its new vertex
  std::vector<std::uint32_t> right, left;
  Vec3 center;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const std::uint32_t v = homology.from(loop[i]);
    const std::uint32_t before = loop[(i + loop.size() - 1) % loop.size()];
    right.push_back(v);
    left.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
    center = center + mesh.positions[v] * (1 / static_cast<float>(loop.size()));
    // The corners at v to the left of the loop, counter-clockwise from the side that goes on.
    for (std::uint32_t side = loop[i];;) {
      renamed.emplace_back(side, left.back());
      const std::uint32_t last = corner_after(corner_after(side));  // from the third vertex to v
      if (last == before) break;
      side = homology.mate(last);
      PM_CHECK(side != loop[i]);
    }
    mesh.positions.push_back(mesh.positions[v]);
    if (!mesh.normals.empty()) mesh.normals.push_back(mesh.normals[v]);
  }
  for (const auto& [corner, vertex] : renamed) mesh.triangles[corner / 3].v[corner % 3] = vertex;
  std::vector<std::uint32_t> changed = right;
  changed.insert(changed.end(), left.begin(), left.end());
  std::reverse(left.begin(), left.end());
  for (const std::vector<std::uint32_t>* rim : {&right, &left}) {
    const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(center);
    if (!mesh.normals.empty()) mesh.normals.push_back({});
    changed.push_back(middle);
    for (std::size_t i = 0; i < rim->size(); ++i)
      mesh.triangles.push_back({{(*rim)[i], (*rim)[(i + 1) % rim->size()], middle}});
  }
  constexpr int kSteps = 24;
  fair(mesh, changed, kSteps);
}

}  // namespace

std::int64_t genus_of(const Mesh& mesh) {
  DisjointSets sets(mesh.positions.size());
  for (const Triangle& t : mesh.triangles) {
    sets.join(t.v[0], t.v[1]);
    sets.join(t.v[0], t.v[2]);
  }
  std::int64_t components = 0;
  for (std::uint32_t v = 0; v < sets.size(); ++v) components += sets.find(v) == v;
  // V - E + F = 2 components - 2 genus, and 2 E = 3 F.
  return components - (2 * static_cast<std::int64_t>(mesh.positions.size()) -
                       static_cast<std::int64_t>(mesh.triangles.size())) /
                          4;
}

std::size_t cut_handles(Mesh& mesh, std::int64_t genus, float longest) {
  constexpr std::int64_t kSteps = 5'000'000;
  std::int64_t steps = kSteps;
  std::size_t done = 0;
  for (std::int64_t surplus = genus_of(mesh) - genus; surplus > 0; --surplus, ++done) {
    const Homology homology(mesh);
    Loop loop;
    // Short loops are found within small disks, and mostly there are some.
    for (float limit = longest / 8; loop.empty() && limit <= longest; limit *= 2)
      loop =
          LoopSearch(homology, mesh.positions.size(), limit, steps).run(3 * mesh.triangles.size());
    if (loop.empty()) break;
    cut(mesh, homology, loop);
  }
  return done;
}

}  // namespace polymorph
