// Vertex placement of marching cubes: one vertex on each crossed edge, at a root of log2(field /
// iso) along the edge, and the normal there.
//
// The logarithm of a Gaussian field is nearly linear (that of a single ball is a parabola), while
// the field itself spans orders of magnitude over one cell. The first estimate is the root of the
// straight line between the edge's ends. Then each of `refine_steps` steps evaluates the field at
// the estimate and takes the root of the parabola through this point and the bracket's ends (Muller
// 1956), which is exact for a single Gaussian ball. With secants instead, an error of 0.012 iso
// remained after three steps if one end of the bracket stuck.
#pragma once

#include <algorithm>
#include <cstdint>
#include <type_traits>

#include "bricks.h"
#include "field.h"
#include "host_device.h"
#include "simd_math.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// Minimum distance of a vertex from its edge's ends, as a fraction of the edge. It keeps the
/// vertices around a grid point apart, and moves them by at most 0.2 % of a cell.
constexpr float kEdgeMargin = 1.0f / 512.0f;

/// Exact sums place a vertex if the field changes along its edge by less than this many times the
/// polynomial's error bound. Actual errors are at most a tenth of their bounds, so that they move
/// other vertices by some thousandths of a cell at most.
constexpr float kFlat = 32;

/// |height| (for balls |log2(field / iso)|) below which a vertex needs no further step: some ten
/// times the rounding error of the field.
constexpr float kCloseEnough = 0x1p-17f;

/// Two points (t, g) along an edge whose heights g have opposite signs, and a third point. For
/// balls the height is log2(field / iso).
template <class V>
struct Bracket {
  V t0, g0, t1, g1, t2, g2;

  /// Returns the root of the line through the first two points.
  PM_HD V line_root() const {
    const V rise = g0 - g1;
    // If different values have equal logarithms, both are within rounding of iso.
    const V s = select(rise != 0.0f, g0 / rise, broadcast<V>(0.5f));
    return fma(t1 - t0, min(max(s, broadcast<V>(0.0f)), broadcast<V>(1.0f)), t0);
  }

  /// Returns the root, inside the bracket, of the parabola through the three points (Muller's
  /// method). If rounding leaves no root there, returns that of the line.
  PM_HD V parabola_root() const {
    const V h = t1 - t0, h2 = t2 - t0;
    const V slope = (g1 - g0) / h;
    const V curvature = ((g2 - g0) / h2 - slope) / (t2 - t1);
    // curvature s^2 + linear s + g0 = 0 with s = t - t0; at the root the slope has the sign of
    // g1 - g0.
    const V linear = fma(-curvature, h, slope);
    const V root = sqrt(max(fma(linear, linear, -4.0f * curvature * g0), broadcast<V>(0.0f)));
    const V s = -2.0f * g0 / (linear + select(slope < 0.0f, -root, root));
    return select((s >= 0.0f) & (s <= h), t0 + s, line_root());
  }
};

/// Edges of one brick, one per lane.
template <class V>
struct Edges {
  using Bits = decltype(float_bits(V{}));
  using Mask = decltype(V{} < V{});
  Points<V> from, step;  ///< the lower end, and the offset from it to the upper end
  V low, high;           ///< the least and the greatest fraction at which the vertex may lie
  V value0, value1;      ///< field at the ends
  Bits axis;
  Mask cut;  ///< the border of the grid cuts this edge
};

/// The field of balls in a brick, as PlaceVertices needs it.
template <class F>
struct BallVertexField {
  static constexpr bool kHasHalves = false;  // level_set.h
  BrickField<F> field;
  BallList all_balls;
  float iso = 1, floor = 0;  ///< the members of BallVertices
  bool exact = true;         ///< whether exact sums may place vertices

  template <class V>
  PM_HD V value(const Points<V>& p) const {
    return field.value(p);
  }
  /// Returns log2(field / iso), which is 0 at the surface and nearly linear along an edge.
  template <class V>
  PM_HD V height(V value) const {
    return log2(max(value, broadcast<V>(floor))) - log2(broadcast<V>(iso));
  }
  /// Returns minus the gradient up to a positive factor; it points outward at the surface.
  template <class V>
  PM_HD Points<V> negated_gradient(const Points<V>& p) const {
    return field.negated_gradient(p);
  }
  /// Returns a mask whose bit l is set if the field is flat along the edge of lane l (kFlat).
  /// `outward`: minus half the gradient at the vertex.
  template <class V>
  PM_HD std::uint32_t flat_lanes(const Edges<V>& edges, const Points<V>& outward) const {
    if constexpr (F::kCompactSupport) return 0;
    if (!exact) return 0;
    const V half_change =
        fma(outward.x, edges.step.x, fma(outward.y, edges.step.y, outward.z * edges.step.z));
    return Lanes<V>::bits(max(half_change, -half_change) <
                          broadcast<V>(0.5f * kFlat * field.far->error));
  }
  /// Returns the sum over all balls in the lanes of the mask `lanes`, and `value` in the others.
  template <class V>
  PM_HD V exact_where(std::uint32_t lanes, V value, const Points<V>& at) const {
    if (F::kCompactSupport || lanes == 0) return value;
    alignas(64) float exact_sum[Lanes<V>::kCount], merged[Lanes<V>::kCount];
    Lanes<V>::store(exact_sum, field_at<F>(at, field.balls, all_balls));
    Lanes<V>::store(merged, value);
    for (int l = 0; l < Lanes<V>::kCount; ++l)
      merged[l] = lanes >> l & 1u ? exact_sum[l] : merged[l];
    return Lanes<V>::load(merged);
  }
};

/// Source of PlaceVertices for balls.
template <class F>
struct BallVertices {
  static constexpr int kThreads = 128, kMinTeams = 0;
  Grid grid;
  float iso = 1;
  float floor = 0;  ///< field values are clamped to at least this before the logarithm
  int margin = 0;   ///< Level::margin of the bricks; above 0, values are interpolated, not exact
  bool midpoint = false;
  View<const std::uint32_t> entries;
  View<const typename F::Ball> balls;
  View<const FarField> far;  ///< per brick, where support is infinite
  BallList all_balls;

  PM_HD BallVertexField<F> brick_field(const Node& brick, std::int64_t b) const {
    return {BrickField<F>(grid, margin, brick, balls.data, entries.data,
                          F::kCompactSupport ? nullptr : &far[b]),
            all_balls, iso, floor, !midpoint && margin == 0};
  }
};

/// Writes position and normal of each vertex. One team per brick. Source: brick_field(brick, index)
/// gives the field in a brick; kThreads and kMinTeams are those of this pass.
template <class Source>
struct PlaceVertices {
  static constexpr int kThreads = Source::kThreads, kMinTeams = Source::kMinTeams;
  struct Scratch {
    /// Per vertex: the bit of its edge in the row and, above it, the row's line. Vectors are stored
    /// and loaded beyond the last vertex.
    std::uint32_t edges[kMaxVertices + kLineSlots];
  };
  Grid grid;
  float iso = 1;
  int refine_steps = 1;
  bool midpoint = false;
  Source source;
  std::int64_t begin = 0;  ///< the brick of item 0
  View<const Node> bricks;
  View<const float> values;        ///< kBrickValues per item
  View<const std::uint32_t> rows;  ///< packed_row() of each row
  View<const Counts> counts;       ///< per brick: vertices, triangles
  View<const Offsets> first;       ///< per brick: its first vertex and triangle
  View<Vec3> positions;
  View<Vec3> normals;

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t brick_item) const {
    using V = typename Team::V;
    constexpr int kLanes = Lanes<V>::kCount;
    const std::int64_t b = begin + brick_item;
    const auto count = static_cast<int>(counts[b].vertices());
    const std::int64_t first_vertex = first[b].vertices();
    if (count == 0 || first_vertex + count > positions.size) return;
    team.each(kRows, [&](int r) {
      const std::uint32_t row = rows[b * kRows + r];
      write_set_bits<V>(row_edges(row), static_cast<std::uint32_t>(line_of_row(r)) << kLineShift,
                        scratch.edges + vertices_before(row));
    });
    // Clears the lanes of the last item that have no vertex. With packs, a team is one thread, so
    // that no other thread writes here.
    if constexpr (kLanes > 1) std::fill_n(scratch.edges + count, kLanes - 1, 0u);
    team.sync();
    const Node brick = bricks[b];
    const auto& field = source.brick_field(brick, b);
    const auto place_from = [&](const auto& of_thread, int vertex, int writes) {
      const Edges<V> edges = edges_at<V>(brick.at, values.data + brick_item * kBrickValues,
                                         Lanes<V>::load_bits(scratch.edges + vertex));
      place<V>(edges, of_thread, first_vertex + vertex, writes);
    };
    if constexpr (kHalves<Team, std::decay_t<decltype(field)>>) {
      // Two neighbouring threads place a vertex together, and the first one writes it. The last
      // warp is filled with threads that repeat the last vertex, because a warp's threads exchange
      // values.
      constexpr int kGroup = static_cast<int>(Team::kGroup);
      team.each((2 * count + kGroup - 1) / kGroup * kGroup, [&](int item) {
        const int vertex = item / 2 < count ? item / 2 : count - 1;
        place_from(field.half(item % 2), vertex, item % 2 == 0 && item / 2 < count ? 1 : 0);
      });
    } else {
      team.each((count + kLanes - 1) / kLanes,
                [&](int item) { place_from(field, item * kLanes, count - item * kLanes); });
    }
  }
  static constexpr int kLineShift = 5;  ///< bits of an edge's index in its row, which is below 21

  /// Unpacks edges, as in Scratch::edges, and finds their ends and the field there. `value`: the
  /// brick's values.
  template <class V>
  PM_HD Edges<V> edges_at(Int3 brick, const float* value,
                          typename Edges<V>::Bits packed_edges) const {
    using Bits = typename Edges<V>::Bits;
    const Bits bit = packed_edges & ((1u << kLineShift) - 1), line = packed_edges >> kLineShift;
    const Bits x = bit * 43u >> 7;  // bit / 3
    Edges<V> out;
    out.axis = bit - 3u * x;
    const auto along_x = out.axis == 0u, along_y = out.axis == 1u, along_z = out.axis == 2u;
    const auto first_point = [](int at) { return static_cast<float>(at * kBrickCells - 1); };
    // The lower end in cells from the grid's origin.
    const Points<V> lower_end = {signed_to_float(x) + first_point(brick.x),
                                 signed_to_float(line % kBrickPoints) + first_point(brick.y),
                                 signed_to_float(line / kBrickPoints) + first_point(brick.z)};
    // The arithmetic is that of grid_point(), for equal bits.
    out.from = {grid.origin.x + grid.cell * lower_end.x, grid.origin.y + grid.cell * lower_end.y,
                grid.origin.z + grid.cell * lower_end.z};
    const Points<V> upper = {grid.origin.x + grid.cell * (lower_end.x + 1.0f),
                             grid.origin.y + grid.cell * (lower_end.y + 1.0f),
                             grid.origin.z + grid.cell * (lower_end.z + 1.0f)};
    out.step = {zero_unless(along_x, upper.x - out.from.x),
                zero_unless(along_y, upper.y - out.from.y),
                zero_unless(along_z, upper.z - out.from.z)};
    const auto select_axis = [&](V x_value, V y_value, V z_value) {
      return select(along_x, x_value, select(along_y, y_value, z_value));
    };
    const auto last = [](int points) { return broadcast<V>(static_cast<float>(points - 1)); };
    const V low = select_axis(lower_end.x, lower_end.y, lower_end.z);
    const auto below = low < 0.0f;
    const auto above =
        low == select_axis(last(grid.points.x), last(grid.points.y), last(grid.points.z));
    const V margin = broadcast<V>(kEdgeMargin), far_margin = broadcast<V>(1 - kEdgeMargin);
    // A vertex on a cut edge lies kEdgeMargin of a cell beyond the border of the grid.
    out.cut = below | above;
    out.low = select(below, far_margin, margin);
    out.high = select(above, margin, far_margin);
    const Bits point = x + static_cast<std::uint32_t>(kBrickPoints) * line;
    out.value0 = gather(value, point);
    // The next point along the axis is 8^axis values on.
    out.value1 = gather(value, point + ((Bits{} + 1u) << (3u * out.axis)));
    return out;
  }

  /// Returns the point at the fraction t of each edge.
  template <class V>
  PM_HD static Points<V> along(const Edges<V>& edges, V t) {
    return {fma(t, edges.step.x, edges.from.x), fma(t, edges.step.y, edges.from.y),
            fma(t, edges.step.z, edges.from.z)};
  }

  /// Writes position and normal of the vertices on `count` edges, from index `to` on. Where the
  /// field is flat, it finds the vertices again from exact sums.
  template <class V, class Field>
  PM_HD void place(const Edges<V>& edges, const Field& field, std::int64_t to, int count) const {
    V t = midpoint ? broadcast<V>(0.5f) : find_root<V>(edges, field, /*flat=*/0);
    Points<V> at = along(edges, t), outward = field.negated_gradient(at);
    const std::uint32_t flat = field.template flat_lanes<V>(edges, outward);
    if (flat != 0) {
      t = find_root<V>(edges, field, flat);
      at = along(edges, t), outward = field.negated_gradient(at);
    }
    const V length2 = fma(outward.z, outward.z, fma(outward.y, outward.y, outward.x * outward.x));
    const V length = sqrt(length2);
    // The normal is the edge's direction on the flat cut at the border, and where the gradient is
    // too short or too long to be normalized.
    const auto has_slope = (length2 > 1e-30f) & (length2 < 1e30f);
    const V unit = broadcast<V>(1.0f), sign = select(edges.value0 > iso, unit, -unit);
    const auto normal = [&](V component, std::uint32_t axis) {
      const V edge_normal = zero_unless(edges.axis == axis, sign);
      return select(edges.cut, edge_normal, select(has_slope, component / length, edge_normal));
    };
    store_points<V>(&positions[to].x, at.x, at.y, at.z, count);
    store_points<V>(&normals[to].x, normal(outward.x, 0), normal(outward.y, 1),
                    normal(outward.z, 2), count);
  }

  /// Finds the fraction of each edge at which the field is iso. `flat`: lanes that use exact sums.
  template <class V, class Field>
  PM_HD V find_root(const Edges<V>& edges, const Field& field, std::uint32_t flat) const {
    V value0 = edges.value0, value1 = edges.value1;
    const V low = edges.low, high = edges.high;
    const V zero = broadcast<V>(0.0f), unit = broadcast<V>(1.0f);
    value0 = field.exact_where(flat, value0, along(edges, zero));
    value1 = field.exact_where(flat, value1, along(edges, unit));
    const V g0 = field.height(value0), g1 = field.height(value1);
    Bracket<V> b = {zero, g0, unit, g1, unit, g1};
    V t = min(max(b.line_root(), low), high);
    for (int s = 0; s < refine_steps; ++s) {
      const Points<V> at = along(edges, t);
      const V value = field.exact_where(flat, field.value(at), at);
      const V g = field.height(value);
      // The estimate replaces the end of the bracket that is on the same side of iso.
      const auto replaces_0 = (value > iso) == (value0 > iso);
      b = {select(replaces_0, t, b.t0),    select(replaces_0, g, b.g0),
           select(replaces_0, b.t1, t),    select(replaces_0, b.g1, g),
           select(replaces_0, b.t0, b.t1), select(replaces_0, b.g0, b.g1)};
      // Below kCloseEnough, differences between the points would be rounding noise.
      const auto converged = (g < kCloseEnough) & (-g < kCloseEnough);
      t = select(converged, t, min(max(b.parabola_root(), low), high));
    }
    return t;
  }
};

}  // namespace polymorph
