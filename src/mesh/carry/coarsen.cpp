#include "mesh/carry/coarsen.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "mesh/fans.h"
#include "mesh/mesh_query.h"

namespace polymorph {
namespace {

/// Smallest cosine between a triangle's normals before and after a collapse.
constexpr float kMinTurnCosine = 0.85f;

struct ShortEdge {
  float length;
  std::uint32_t low, high;
};

/// One pass of collapses over a mesh. No triangle around a collapsed edge changes again in the
/// pass.
class CollapsePass {
 public:
  CollapsePass(std::vector<Vec3>& points, std::vector<Triangle>& triangles,
               const CoarsenSettings& settings)
      : points_(points),
        triangles_(triangles),
        settings_(settings),
        fans_(points.size(), triangles),
        is_moved_(points.size(), 0),
        is_apex_(points.size(), 0),
        merged_into_(points.size()) {
    for (std::uint32_t i = 0; i < merged_into_.size(); ++i) merged_into_[i] = i;
  }

  /// Returns the number of collapsed edges.
  std::size_t run() {
    std::size_t count = 0;
    for (const ShortEdge& edge : list_short_edges()) count += collapse(edge);
    remove_merged();
    return count;
  }

 private:
  std::vector<ShortEdge> list_short_edges() const {
    std::vector<ShortEdge> edges;
    for (const Triangle& t : triangles_)
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = t.v[k], b = t.v[(k + 1) % 3];
        if (a > b) continue;  // the triangle on the other side lists it
        if (const float d = length(points_[a] - points_[b]); d < settings_.edge)
          edges.push_back({d, a, b});
      }
    std::sort(edges.begin(), edges.end(), [](const ShortEdge& x, const ShortEdge& y) {
      return x.length != y.length ? x.length < y.length
             : x.low != y.low     ? x.low < y.low
                                  : x.high < y.high;
    });
    return edges;
  }

  std::vector<std::uint32_t> list_neighbours(std::uint32_t v) const {
    std::vector<std::uint32_t> neighbours;
    for (const std::uint32_t f : fans_.around(v))
      for (const std::uint32_t p : triangles_[f].v)
        if (p != v) neighbours.push_back(p);
    std::sort(neighbours.begin(), neighbours.end());
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
    return neighbours;
  }

  /// Tests whether the triangles around `v` stay near their planes and normals, and small, if it
  /// moves to `at`. Triangles with `other`, the edge's other end, vanish.
  bool allows_move(std::uint32_t v, std::uint32_t other, Vec3 at) const {
    for (const std::uint32_t f : fans_.around(v)) {
      const Triangle& t = triangles_[f];
      const Vec3 before = area_normal(points_, t);
      const float area = length(before);
      if (area > 0 && std::abs(dot(before / area, at - points_[v])) > settings_.deviation)
        return false;
      if (std::find(t.v, t.v + 3, other) != t.v + 3) continue;
      Vec3 p[3];
      for (int k = 0; k < 3; ++k) {
        p[k] = t.v[k] == v ? at : points_[t.v[k]];
        if (t.v[k] != v && length(points_[t.v[k]] - at) > 1.5f * settings_.edge) return false;
      }
      const Vec3 after = cross(p[1] - p[0], p[2] - p[0]);
      if (!(dot(before, after) > kMinTurnCosine * area * length(after))) return false;
    }
    return true;
  }

  bool collapse(const ShortEdge& edge) {
    const auto [d, a, b] = edge;
    if (is_moved_[a] || is_moved_[b]) return false;
    const std::vector<std::uint32_t> around_a = list_neighbours(a), around_b = list_neighbours(b);
    std::vector<std::uint32_t> shared;
    std::set_intersection(around_a.begin(), around_a.end(), around_b.begin(), around_b.end(),
                          std::back_inserter(shared));
    // The link condition (Dey, Edelsbrunner, Guha and Nekhayev 1999) keeps the topology. The new
    // point has 5 neighbours or more, the apexes of the vanishing triangles 3 or more.
    if (shared.size() != 2 || around_a.size() + around_b.size() < 9) return false;
    for (const std::uint32_t p : shared)
      if (is_apex_[p] || fans_.around(p).size() < 4) return false;
    for (const auto* neighbours : {&around_a, &around_b})
      for (const std::uint32_t p : *neighbours)
        if (is_moved_[p]) return false;
    const Vec3 at = (points_[a] + points_[b]) * 0.5f;
    if (!allows_move(a, b, at) || !allows_move(b, a, at)) return false;
    points_[a] = at;
    merged_into_[b] = a;
    is_moved_[a] = is_moved_[b] = 1;
    for (const std::uint32_t p : shared) is_apex_[p] = 1;
    return true;
  }

  /// Removes the points and triangles that vanish in collapses.
  void remove_merged() {
    std::vector<std::uint32_t> new_index(points_.size());
    std::vector<Vec3> new_points;
    for (std::uint32_t i = 0; i < points_.size(); ++i)
      if (merged_into_[i] == i)
        new_index[i] = static_cast<std::uint32_t>(new_points.size()),
        new_points.push_back(points_[i]);
    std::vector<Triangle> new_triangles;
    for (Triangle t : triangles_) {
      for (std::uint32_t& v : t.v) v = new_index[merged_into_[v]];
      if (t.v[0] != t.v[1] && t.v[1] != t.v[2] && t.v[2] != t.v[0]) new_triangles.push_back(t);
    }
    points_ = std::move(new_points);
    triangles_ = std::move(new_triangles);
  }

  std::vector<Vec3>& points_;
  std::vector<Triangle>& triangles_;
  const CoarsenSettings& settings_;
  Fans fans_;
  std::vector<std::uint8_t> is_moved_;      ///< ends of collapsed edges
  std::vector<std::uint8_t> is_apex_;       ///< points that have lost a triangle
  std::vector<std::uint32_t> merged_into_;  ///< per point: the point that replaces it, or itself
};

}  // namespace

void coarsen(std::vector<Vec3>& points, std::vector<Triangle>& triangles,
             const CoarsenSettings& settings) {
  constexpr int kMaxPasses = 24;
  for (int pass = 0; pass < kMaxPasses; ++pass)
    if (CollapsePass(points, triangles, settings).run() * 100 < points.size()) return;  // below 1 %
}

}  // namespace polymorph
