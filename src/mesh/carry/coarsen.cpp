#include "mesh/carry/coarsen.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>

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
  CollapsePass(const CoarsenedMesh& mesh, const CoarsenSettings& settings)
      : mesh_(mesh),
        points_(*mesh.shapes.front()),
        triangles_(mesh.triangles),
        settings_(settings),
        fans_(points_.size(), triangles_),
        is_moved_(points_.size(), 0),
        is_apex_(points_.size(), 0),
        merged_into_(points_.size()) {
    for (std::uint32_t i = 0; i < merged_into_.size(); ++i) merged_into_[i] = i;
  }

  /// Returns the new index of each point.
  std::vector<std::uint32_t> run() {
    for (const ShortEdge& edge : list_short_edges()) collapse(edge);
    return remove_merged();
  }

 private:
  std::vector<ShortEdge> list_short_edges() const {
    std::vector<ShortEdge> edges;
    const auto list_edges = [&](const Triangle& t, bool are_all) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = t.v[k], b = t.v[(k + 1) % 3];
        if (!are_all && a > b) continue;  // the triangle on the other side lists it
        if (const float d = length(points_[a] - points_[b]); d < settings_.edge)
          edges.push_back({d, std::min(a, b), std::max(a, b)});
      }
    };
    if (settings_.accepts)
      for (const std::uint32_t f : settings_.chosen) list_edges(triangles_[f], true);
    else
      for (const Triangle& t : triangles_) list_edges(t, false);
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

  /// Returns how far the triangles around `v` would leave their planes in one shape if it moved to
  /// `at`, or infinity if one would turn too far or become too long. Triangles with `other`, the
  /// edge's other end, vanish.
  float deviation_of_move(const std::vector<Vec3>& points, std::uint32_t v, std::uint32_t other,
                          Vec3 at) const {
    constexpr float kForbidden = std::numeric_limits<float>::infinity();
    const bool is_first = &points == &points_, is_judged = is_first && settings_.accepts;
    float deviation = 0;
    for (const std::uint32_t f : fans_.around(v)) {
      const Triangle& t = triangles_[f];
      const Vec3 before = area_normal(points, t);
      const float area = length(before);
      if (area > 0 && !is_judged)
        deviation = std::max(deviation, std::abs(dot(before / area, at - points[v])));
      if (std::find(t.v, t.v + 3, other) != t.v + 3) continue;
      Vec3 p[3];
      for (int k = 0; k < 3; ++k) {
        p[k] = t.v[k] == v ? at : points[t.v[k]];
        if (is_first && t.v[k] != v && length(points[t.v[k]] - at) > 1.5f * settings_.edge)
          return kForbidden;
      }
      if (is_judged) {
        if (!(*settings_.accepts)(p[0], p[1], p[2]) &&
            (*settings_.accepts)(points[t.v[0]], points[t.v[1]], points[t.v[2]]))
          return kForbidden;
        continue;
      }
      const Vec3 after = cross(p[1] - p[0], p[2] - p[0]);
      if (!(dot(before, after) > kMinTurnCosine * area * length(after))) return kForbidden;
    }
    return deviation;
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
    std::vector<float>* deviations = mesh_.deviations;
    const float earlier = deviations ? std::max((*deviations)[a], (*deviations)[b]) : 0.0f;
    if (!(earlier <= settings_.deviation)) return false;
    float deviation = 0;
    for (const std::vector<Vec3>* points : mesh_.shapes) {
      const Vec3 at = ((*points)[a] + (*points)[b]) * 0.5f;
      deviation = std::max(
          {deviation, deviation_of_move(*points, a, b, at), deviation_of_move(*points, b, a, at)});
      if (!(earlier + deviation <= settings_.deviation)) return false;
    }
    for (std::vector<Vec3>* points : mesh_.shapes)
      (*points)[a] = ((*points)[a] + (*points)[b]) * 0.5f;
    if (deviations) (*deviations)[a] = earlier + deviation;
    merged_into_[b] = a;
    is_moved_[a] = is_moved_[b] = 1;
    for (const std::uint32_t p : shared) is_apex_[p] = 1;
    return true;
  }

  /// Removes the points and triangles that vanish in collapses. Returns the points' new indices.
  std::vector<std::uint32_t> remove_merged() {
    std::vector<std::uint32_t> new_index(points_.size());
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < new_index.size(); ++i)
      if (merged_into_[i] == i) new_index[i] = count++;
    const auto compact = [&](auto& values) {
      for (std::uint32_t i = 0; i < new_index.size(); ++i)
        if (merged_into_[i] == i) values[new_index[i]] = values[i];
      values.resize(count);
    };
    for (std::vector<Vec3>* points : mesh_.shapes) compact(*points);
    if (mesh_.deviations) compact(*mesh_.deviations);
    for (std::uint32_t i = 0; i < new_index.size(); ++i) new_index[i] = new_index[merged_into_[i]];
    std::vector<Triangle> new_triangles;
    for (Triangle t : triangles_) {
      for (std::uint32_t& v : t.v) v = new_index[v];
      if (t.v[0] != t.v[1] && t.v[1] != t.v[2] && t.v[2] != t.v[0]) new_triangles.push_back(t);
    }
    triangles_ = std::move(new_triangles);
    return new_index;
  }

  const CoarsenedMesh& mesh_;
  const std::vector<Vec3>& points_;  ///< the first shape
  std::vector<Triangle>& triangles_;
  const CoarsenSettings& settings_;
  Fans fans_;
  std::vector<std::uint8_t> is_moved_;      ///< ends of collapsed edges
  std::vector<std::uint8_t> is_apex_;       ///< points that have lost a triangle
  std::vector<std::uint32_t> merged_into_;  ///< per point: the point that replaces it, or itself
};

}  // namespace

std::vector<std::uint32_t> coarsen(const CoarsenedMesh& mesh, const CoarsenSettings& settings) {
  constexpr int kMaxPasses = 24;
  std::vector<std::uint32_t> new_index(mesh.shapes.front()->size());
  std::iota(new_index.begin(), new_index.end(), 0u);
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    const std::size_t before = mesh.shapes.front()->size();
    const std::vector<std::uint32_t> index_after_pass = CollapsePass(mesh, settings).run();
    for (std::uint32_t& i : new_index) i = index_after_pass[i];
    const std::size_t after = mesh.shapes.front()->size();
    if (settings.accepts || (before - after) * 100 < after) break;  // below 1 %
  }
  return new_index;
}

}  // namespace polymorph
