// The surface between two objects as a level set: both objects' signed distances, pulled along one
// smooth map and mixed (docs/method.md, Surface between; Cohen-Or, Solomovici and Levin 1998).
//
// A point x comes from X_A(x) on the source and goes to X_B(x) on the target; the field there is
// (1 - b) S(D_A(X_A)) + b S(D_B(X_B)) - c w, b = t^2 (3 - 2 t), t the progress of what is there, c
// the level and w its weight there; S(d) has the sign of d and the size s (sqrt(1 + 2 |d| / s) -
// 1). X_A, X_B and t are one regression over the moving balls (regression.h). So is w where an
// object is a shell; elsewhere it is made, at the lattice's nodes, of how thin both objects are
// (WeighLevel). The surface is where the field is 0.
#pragma once

#include <cstdint>

#include "bricks.h"
#include "distance_field.h"
#include "field.h"
#include "host_device.h"
#include "regression.h"
#include "tree.h"
#include "view.h"

namespace polymorph {

/// The field as the kernels read it.
struct MorphField {
  SmoothMap map;  ///< 0: to the source, with the progress; 1: to the target
  DistanceField from, to;
  float from_scale = 1, to_scale = 1;  ///< scene units per unit of each object's distances
  float level = 0;
  float per_range = 0;  ///< 1 / s; 0: S(d) = d

  /// S(d). What is thin holds small distances: beside the large ones of another object far away it
  /// would show only when next to nothing is left of that one. The same inside and outside, so that
  /// neither object takes more than its share.
  template <class V>
  PM_HD V compressed(V distance) const {
    return distance / fma(per_slope(distance), broadcast<V>(0.5f), broadcast<V>(0.5f));
  }
  /// 1 / S'(d) = sqrt(1 + 2 |d| / s).
  template <class V>
  PM_HD V per_slope(V distance) const {
    return sqrt(fma(max(distance, -distance), broadcast<V>(2.0f * per_range), broadcast<V>(1.0f)));
  }

  /// The mixture and its derivative by the progress.
  template <class V>
  PM_HD static V mixture(V progress) {
    const V t = min(max(progress, broadcast<V>(0.0f)), broadcast<V>(1.0f));
    return t * t * (3.0f - 2.0f * t);
  }
  PM_HD static float mixture_slope(float progress) {
    const float t = min(max(progress, 0.0f), 1.0f);
    return 6 * t * (1 - t);
  }

  /// From columns of the map's eight values at p.
  template <class V>
  PM_HD V value(const Points<V>& p, const V (&m)[kRegressionValues]) const {
    const V a = compressed(from_scale * from.at(map.mapped(0, p, Points<V>{m[0], m[1], m[2]})));
    const V b = compressed(to_scale * to.at(map.mapped(1, p, Points<V>{m[4], m[5], m[6]})));
    return fma(broadcast<V>(-level), m[7], fma(mixture(m[3]), b - a, a));
  }
  /// Both objects' distances at any points, before they are compressed and mixed, and the columns
  /// there.
  template <class V>
  PM_HD void distances(const Points<V>& p, V (&m)[kRegressionValues], V& a, V& b) const {
    map_columns(p, m);
    a = from_scale * from.at(map.mapped(0, p, Points<V>{m[0], m[1], m[2]}));
    b = to_scale * to.at(map.mapped(1, p, Points<V>{m[4], m[5], m[6]}));
  }
  /// At any points.
  template <class V>
  PM_HD V value(const Points<V>& p) const {
    V columns[kRegressionValues];
    map_columns(p, columns);
    return value(p, columns);
  }

  template <class V>
  PM_HD void map_columns(const Points<V>& p, V (&columns)[kRegressionValues]) const {
    constexpr int kLanes = Lanes<V>::kCount;
    alignas(32) float x[kLanes], y[kLanes], z[kLanes], of[kRegressionValues][kLanes];
    Lanes<V>::store(x, p.x), Lanes<V>::store(y, p.y), Lanes<V>::store(z, p.z);
    for (int l = 0; l < kLanes; ++l) {
      alignas(32) float value[kRegressionValues];
      map.spline({x[l], y[l], z[l]}, value);
      for (int i = 0; i < kRegressionValues; ++i) of[i][l] = value[i];
    }
    for (int i = 0; i < kRegressionValues; ++i) columns[i] = Lanes<V>::load(of[i]);
  }

  /// -gradient: outward at the surface.
  template <class V>
  PM_HD Points<V> negated_gradient(const Points<V>& p) const {
    constexpr int kLanes = Lanes<V>::kCount;
    alignas(32) float x[kLanes], y[kLanes], z[kLanes];
    alignas(32) float of[4][kRegressionValues][kLanes];
    Lanes<V>::store(x, p.x), Lanes<V>::store(y, p.y), Lanes<V>::store(z, p.z);
    for (int l = 0; l < kLanes; ++l) {
      alignas(32) float value[kRegressionValues], slopes[3][kRegressionValues];
      map.spline({x[l], y[l], z[l]}, value, slopes);
      for (int i = 0; i < kRegressionValues; ++i) {
        of[3][i][l] = value[i];
        for (int axis = 0; axis < 3; ++axis) of[axis][i][l] = slopes[axis][i];
      }
    }
    const auto value_of = [&](int i) { return Lanes<V>::load(of[3][i]); };
    const Points<V> a = map.mapped(0, p, Points<V>{value_of(0), value_of(1), value_of(2)});
    const Points<V> b = map.mapped(1, p, Points<V>{value_of(4), value_of(5), value_of(6)});
    const Points<V> slope_a = from.gradient(a), slope_b = to.gradient(b);
    alignas(32) float by_progress[kLanes];
    Lanes<V>::store(by_progress, value_of(3));
    for (int l = 0; l < kLanes; ++l) by_progress[l] = mixture_slope(by_progress[l]);
    const V from_distance = from_scale * from.at(a), to_distance = to_scale * to.at(b);
    const V change =
        Lanes<V>::load(by_progress) * (compressed(to_distance) - compressed(from_distance));
    const V from_by = from_scale / per_slope(from_distance);
    const V to_by = to_scale / per_slope(to_distance);
    const V mixed = mixture(value_of(3));
    const auto along = [&](int axis) {
      const auto slope_of = [&](int i) { return Lanes<V>::load(of[axis][i]); };
      const auto by = [&](const AffineMap& affine, int first, const Points<V>& slope) {
        const auto of_row = [&](int i) {
          const Vec3 row = affine.rows[i];
          return slope_of(first + i) + (axis == 0 ? row.x : axis == 1 ? row.y : row.z);
        };
        return fma(slope.x, of_row(0), fma(slope.y, of_row(1), slope.z * of_row(2)));
      };
      const V from_slope = from_by * by(map.affine[0], 0, slope_a);
      const V to_slope = to_by * by(map.affine[1], 4, slope_b);
      const V of_maps = fma(mixed, to_slope - from_slope, fma(change, slope_of(3), from_slope));
      return fma(broadcast<V>(level), slope_of(7), -of_maps);
    };
    return {along(0), along(1), along(2)};
  }
};

/// Which children of a node the surface can cross: by distances, progress and weight in their
/// middles, and how far these can change from there. Teams share a node as in ClassifyChildren.
struct ClassifyMorph {
  static constexpr int kThreads = 512;
  struct Scratch {};
  Grid grid;
  Level level;  ///< of the children
  MorphField field;
  View<const Strain> strain;
  float affine_norm = 1;  ///< the affine maps' norm times their object's scale, the larger one
  float lipschitz = 1;    ///< of the distances, the larger one
  View<Node> parents;
  View<Counts> sums;  ///< of each parent: children kept; 0 before

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch&, std::int64_t item) const {
    constexpr int kEach = kChildren / Team::kParts;
    const std::int64_t p = item / Team::kParts;
    const int begin = static_cast<int>(item % Team::kParts) * kEach;
    const Node parent = parents[p];
    team.each_group(kEach, [&](int i) {
      const int child = begin + i;
      const Int3 at = child_position(parent.at, child);
      const bool exists = at.x < level.nodes.x && at.y < level.nodes.y && at.z < level.nodes.z;
      const bool keep = exists && can_cross(team, at);
      if (!keep || !team.leads_group()) return;
      team.add(parents[p].children, std::uint64_t{1} << child);
      team.add(sums[p].first, 1u);
    });
  }

  template <class Team>
  PM_HD bool can_cross(const Team& team, Int3 at) const {
    const NodeBox box = node_box(grid, level.cells, 0, at);
    const Vec3 half = 0.5f * (box.high - box.low), middle = box.low + half;
    const Strain most = max_strain(team, box);
    if (!crossed(Points<float>{middle.x, middle.y, middle.z}, half, most, box.has_rim))
      return false;
    return level.cells > kBrickCells || can_cross_parts<typename Team::V>(team, box, most);
  }

  /// Whether the surface can cross any of a brick's 4^3 parts: what is known to be far from it
  /// need not be sampled.
  template <class V, class Team>
  PM_HD bool can_cross_parts(const Team& team, const NodeBox& box, const Strain& most) const {
    constexpr int kSide = 4, kParts = kSide * kSide * kSide, kLanes = Lanes<V>::kCount;
    const Vec3 size = (1.0f / kSide) * (box.high - box.low);
    float any = 0;
    for (int i = static_cast<int>(team.group_rank()); i < kParts / kLanes && any == 0;
         i += static_cast<int>(team.kGroup)) {
      alignas(32) float x[kLanes], y[kLanes], z[kLanes];
      for (int l = 0; l < kLanes; ++l) {
        const int part = kLanes * i + l;
        x[l] = box.low.x + size.x * (0.5f + static_cast<float>(part % kSide));
        y[l] = box.low.y + size.y * (0.5f + static_cast<float>(part / kSide % kSide));
        z[l] = box.low.z + size.z * (0.5f + static_cast<float>(part / (kSide * kSide)));
      }
      const Points<V> middles = {Lanes<V>::load(x), Lanes<V>::load(y), Lanes<V>::load(z)};
      if (crossed(middles, 0.5f * size, most, box.has_rim) != 0) any = 1;
    }
    return team.group_max(any) > 0;
  }

  /// Bit l: the surface can cross the box around point l that reaches `half` to each side, in which
  /// `most` holds.
  template <class V>
  PM_HD std::uint32_t crossed(const Points<V>& middle, Vec3 half, const Strain& most,
                              bool has_rim) const {
    V a, b, columns[kRegressionValues];
    field.distances(middle, columns, a, b);
    const auto norm = [](Vec3 v) { return sqrt(dot(v, v)); };
    // Rounding, generously.
    const float rounding = 1e-4f * grid.cell, radius = 1.001f * norm(half);
    const float reach = radius * lipschitz * (affine_norm + norm(most.maps)) + rounding;
    const float later = radius * norm(most.fourth[0]) + 1e-5f;
    const float level_size = field.level < 0 ? -field.level : field.level;
    const float raised = level_size * (radius * norm(most.fourth[1]) + 1e-5f) + rounding;
    const V first = MorphField::mixture(columns[3] - later),
            last = MorphField::mixture(columns[3] + later);
    const V shift = -field.level * columns[7];
    const V high_a = field.compressed(a + reach), high_b = field.compressed(b + reach) - high_a;
    const V high = max(fma(first, high_b, high_a), fma(last, high_b, high_a)) + shift + raised;
    const std::uint32_t inside = Lanes<V>::bits(high > 0.0f);
    if (has_rim || inside == 0) return inside;
    const V low_a = field.compressed(a - reach), low_b = field.compressed(b - reach) - low_a;
    const V low = min(fma(first, low_b, low_a), fma(last, low_b, low_a)) + shift - raised;
    return inside & Lanes<V>::bits(low <= 0.0f);
  }

  template <class Team>
  PM_HD Strain max_strain(const Team& team, const NodeBox& box) const {
    const Grid& lattice = field.map.lattice;
    const float origin[3] = {lattice.origin.x, lattice.origin.y, lattice.origin.z};
    const float low[3] = {box.low.x, box.low.y, box.low.z};
    const float high[3] = {box.high.x, box.high.y, box.high.z};
    const int points[3] = {lattice.points.x, lattice.points.y, lattice.points.z};
    int first[3], count[3];
    for (int axis = 0; axis < 3; ++axis) {
      const SplineAxis a(low[axis], origin[axis], field.map.per_node, points[axis]);
      const SplineAxis b(high[axis], origin[axis], field.map.per_node, points[axis]);
      // Rounding may take a point to the next node.
      first[axis] = a.first > 0 ? a.first - 1 : 0;
      const int end = b.first + 4 < points[axis] ? b.first + 4 : points[axis];
      count[axis] = end - first[axis];
    }
    const int all = count[0] * count[1] * count[2];
    Strain largest;
    for (int i = static_cast<int>(team.group_rank()); i < all; i += static_cast<int>(team.kGroup)) {
      const std::int64_t x = first[0] + i % count[0], y = first[1] + i / count[0] % count[1],
                         z = first[2] + i / count[0] / count[1];
      const Strain& here = strain[x + points[0] * (y + points[1] * z)];
      largest.maps = max(largest.maps, here.maps);
      for (int k = 0; k < 2; ++k) largest.fourth[k] = max(largest.fourth[k], here.fourth[k]);
    }
    const auto of_group = [&](Vec3 v) {
      return Vec3{team.group_max(v.x), team.group_max(v.y), team.group_max(v.z)};
    };
    return {of_group(largest.maps), {of_group(largest.fourth[0]), of_group(largest.fourth[1])}};
  }
};

/// Writes the kept children of a node. One team per node.
struct FillMorph {
  static constexpr int kThreads = 64;
  struct Scratch {};
  View<Node> parents;
  View<const Offsets> first;  ///< child of each parent
  View<Node> nodes;
  View<Counts> sums;  ///< of each node, for ClassifyMorph to add to; none for bricks

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch&, std::int64_t p) const {
    const Node parent = parents[p];
    const Offsets start = first[p];
    team.each(1, [&](int) { parents[p].first_child = static_cast<std::uint32_t>(start.first); });
    team.each(kChildren, [&](int c) {
      if (!(parent.children >> c & 1u)) return;
      const std::int64_t slot = start.first + popcount(parent.children & bits_below(c));
      if (slot >= nodes.size) return;
      Node node;
      node.at = child_position(parent.at, c);
      node.parent = static_cast<std::uint32_t>(p);
      nodes[slot] = node;
      if (slot < sums.size) sums[slot] = {};
    });
  }
};

/// The root of the tree; one item.
struct PrepareMorph {
  Int3 roots;
  View<Node> nodes;
  View<Counts> sums;
  View<Offsets> node_count;

  PM_HD void operator()(std::int64_t i) const {
    if (i >= nodes.size) return;
    const auto root = static_cast<int>(i);
    Node node;
    node.at = {root % roots.x, root / roots.x % roots.y, root / roots.x / roots.y};
    nodes[i] = node;
    sums[i] = {};
    if (i == 0) node_count[0] = {nodes.size, 0};
  }
};

/// The field between two objects at each brick's points, and what CountBricks makes of it. One team
/// per brick.
struct SampleMorph : CountBricks {
  static constexpr int kThreads = 128;
  MorphField field;

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t item) const {
    using V = typename Lanes<typename Team::V>::Half;
    constexpr int kPacks = kBrickPoints / Lanes<V>::kCount;
    const Int3 first = first_point(bricks[begin + item]);
    team.each(kPacks * kLines, [&](int pack) {
      const int line = pack / kPacks, at = pack % kPacks * Lanes<V>::kCount;
      const Int3 start = {first.x + at, first.y + line % kBrickPoints,
                          first.z + line / kBrickPoints};
      Lanes<V>::store(scratch.values + kBrickPoints * line + at, line_values<V>(start));
    });
    team.sync();
    count(team, scratch, item, first);
  }

  /// As MorphField::value(), but what the points of a line share along y and z is worked out once.
  template <class V>
  PM_HD V line_values(Int3 start) const {
    constexpr int kLanes = Lanes<V>::kCount;
    const V numbers = Lanes<V>::iota() + static_cast<float>(start.x);
    const Vec3 corner = grid_point(grid, start);
    const Points<V> p = {grid.origin.x + grid.cell * numbers, broadcast<V>(corner.y),
                         broadcast<V>(corner.z)};
    if constexpr (kLanes == 1) {
      return field.value(p);
    } else {
      const SmoothMap& map = field.map;
      const SplineAxis y(corner.y, map.lattice.origin.y, map.per_node, map.lattice.points.y);
      const SplineAxis z(corner.z, map.lattice.origin.z, map.per_node, map.lattice.points.z);
      // A coarse surface's line reaches over many nodes: a ring of columns that are known.
      typename SmoothMap::Values column[4];
      int known[4] = {-1, -1, -1, -1};
      alignas(32) float x[kLanes], of[kRegressionValues][kLanes];
      Lanes<V>::store(x, p.x);
      for (int l = 0; l < kLanes; ++l) {
        const SplineAxis at(x[l], map.lattice.origin.x, map.per_node, map.lattice.points.x);
        typename SmoothMap::Values three[3];
        for (int i = 0; i < 3; ++i) {
          const int n = at.first + i, slot = n & 3;
          if (known[slot] != n) {
            column[slot] = map.reduced(n, y.first, z.first, y.weight, z.weight);
            known[slot] = n;
          }
          three[i] = column[slot];
        }
        alignas(32) float value[kRegressionValues];
        SmoothMap::blend_columns(three, at.weight, value);
        for (int i = 0; i < kRegressionValues; ++i) of[i][l] = value[i];
      }
      V columns[kRegressionValues];
      for (int i = 0; i < kRegressionValues; ++i) columns[i] = Lanes<V>::load(of[i]);
      return field.value(p, columns);
    }
  }
};

/// The field between two objects, as vertices need it.
struct MorphVertexField {
  MorphField field;
  float per_cell = 1;

  template <class V>
  PM_HD V value(const Points<V>& p) const {
    return field.value(p);
  }
  template <class V>
  PM_HD V height(V of) const {
    return of * per_cell;
  }
  template <class V>
  PM_HD Points<V> negated_gradient(const Points<V>& p) const {
    return field.negated_gradient(p);
  }
  template <class V, class Edges>
  PM_HD std::uint32_t flat_lanes(const Edges&, const Points<V>&) const {
    return 0;
  }
  template <class V>
  PM_HD V exact_where(std::uint32_t, V value, const Points<V>&) const {
    return value;
  }
};
/// The same as a source of PlaceVertices.
struct MorphVertices {
  MorphVertexField field;
  PM_HD MorphVertexField field_of(const Node&, std::int64_t) const { return field; }
};

/// The level's weight at each node: smaller where an object is thin, because limbs would otherwise
/// vanish to keep the volume. It rises again over some distance, as a square, so that a limb's root
/// and a rim are kept with the limb and the wall. One item per node.
struct WeighLevel {
  SmoothMap map;
  DistanceField thinness[2];
  View<float> nodes;  ///< the map's

  PM_HD void operator()(std::int64_t n) const {
    const Int3 points = map.lattice.points;
    const std::int64_t row = n / points.x;
    const Vec3 p =
        grid_point(map.lattice, {static_cast<int>(n % points.x), static_cast<int>(row % points.y),
                                 static_cast<int>(row / points.y)});
    float* node = nodes.data + kRegressionValues * n;
    float weight = 1;
    for (int m = 0; m < 2; ++m) {
      const float* v = node + 4 * m;
      const Points<float> at =
          map.mapped(m, Points<float>{p.x, p.y, p.z}, Points<float>{v[0], v[1], v[2]});
      // Distances are negative beyond their grid.
      weight *= 1.0f - min(max(thinness[m].at(at), 0.0f), 1.0f);
    }
    node[kRegressionValues - 1] = weight * weight;
  }
};

/// What a regression says at points; one item per point.
struct SampleMap {
  SmoothMap map;
  View<const Vec3> points;
  View<AttributeValues> out;  ///< `maps` for each point
  int maps = 1;

  PM_HD void operator()(std::int64_t i) const {
    if (i >= points.size) return;
    const Vec3 p = points[i];
    alignas(32) float value[kRegressionValues];
    map.spline(p, value);
    for (int m = 0; m < maps; ++m) {
      const float* v = value + 4 * m;
      const Points<float> x =
          map.mapped(m, Points<float>{p.x, p.y, p.z}, Points<float>{v[0], v[1], v[2]});
      out[i * maps + m] = {{x.x, x.y, x.z, v[3]}};
    }
  }
};

}  // namespace polymorph
