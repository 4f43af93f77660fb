// Vertex placement of marching cubes: one vertex on each crossed edge, at a root of log2(field /
// iso) along the edge, and the normal there.
//
// The logarithm, because a Gaussian field is nearly linear in it (a lone ball's is a parabola),
// while the field itself spans orders of magnitude over one cell. First the straight line between
// the edge's ends, then `refine_steps` steps, each with one more value of the field inside the
// bracket: the root of the parabola through that point and the last two (Muller 1956), which is
// exact for a lone Gaussian ball. A secant in its place left 0.012 of iso after three steps where
// an end of the bracket stuck.
#pragma once

#include <cstdint>

#include "bricks.h"
#include "field.h"
#include "host_device.h"
#include "math.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// A vertex keeps this fraction of an edge away from the edge's ends: the vertices around one grid
/// point stay apart, at most 0.2 % of a cell from where they belong.
constexpr float kEdgeMargin = 1.0f / 512.0f;

/// Where the field changes along a vertex' edge by less than this many times its polynomial's
/// bound, exact sums place the vertex. Errors are a tenth of their bounds at most, so that the
/// others move by some thousandths of a cell at most.
constexpr float kFlat = 32;

/// |height| (log2(field / iso) of balls) at which a vertex needs no further step: some ten times
/// the rounding of the field.
constexpr float kCloseEnough = 0x1p-17f;

/// Two points of log2(field / iso) along an edge with opposite signs, and a third one.
template <class V>
struct Bracket {
  V t0, g0, t1, g1, t2, g2;

  PM_HD V line_root() const {
    const V rise = g0 - g1;
    // Equal logarithms of different values: both within rounding of iso.
    const V s = select(rise != 0.0f, g0 / rise, broadcast<V>(0.5f));
    return fma(t1 - t0, min(max(s, broadcast<V>(0.0f)), broadcast<V>(1.0f)), t0);
  }

  /// The root inside the bracket of the parabola through the three points; where rounding leaves
  /// none there, that of the line.
  PM_HD V parabola_root() const {
    const V h = t1 - t0, h2 = t2 - t0;
    const V slope = (g1 - g0) / h;
    const V bend = ((g2 - g0) / h2 - slope) / (t2 - t1);
    // bend s^2 + linear s + g0 = 0 with s = t - t0; at the root the slope has the sign of g1 - g0.
    const V linear = fma(-bend, h, slope);
    const V root = sqrt(max(fma(linear, linear, -4.0f * bend * g0), broadcast<V>(0.0f)));
    const V s = -2.0f * g0 / (linear + select(slope < 0.0f, -root, root));
    return select((s >= 0.0f) & (s <= h), t0 + s, line_root());
  }
};

/// Edges of one brick, one per lane, as columns.
template <int kLanes>
struct EdgeColumns {
  alignas(32) float x[kLanes], y[kLanes], z[kLanes];  ///< lower end
  float step_x[kLanes], step_y[kLanes], step_z[kLanes];
  float low[kLanes], high[kLanes];       ///< where the vertex may lie, as a fraction
  float value0[kLanes], value1[kLanes];  ///< field at the ends
  int axis[kLanes];
  bool cut[kLanes];  ///< the border of the grid cuts this edge
};

/// The field of balls in a brick, as vertices need it.
template <class F>
struct BallVertexField {
  BrickField<F> field;
  BallList all_balls;
  float iso = 1, floor = 0;
  bool exact = true;  ///< can exact sums place a vertex?

  template <class V>
  PM_HD V value(const Points<V>& p) const {
    return field.value(p);
  }
  /// 0 at the level, and nearly linear along an edge.
  template <class V>
  PM_HD V height(V of) const {
    return log2(max(of, broadcast<V>(floor))) - log2(broadcast<V>(iso));
  }
  /// -grad of the field up to a positive factor: outward at the surface.
  template <class V>
  PM_HD Points<V> negated_gradient(const Points<V>& p) const {
    return field.negated_gradient(p);
  }
  /// Bit l: the field is flat along the edge of lane l, where the negated gradient is `down`.
  template <class V>
  PM_HD std::uint32_t flat_lanes(const EdgeColumns<Lanes<V>::kCount>& edges,
                                 const Points<V>& down) const {
    if constexpr (F::kCompactSupport) return 0;
    if (!exact) return 0;
    using L = Lanes<V>;
    const V half = fma(down.x, L::load(edges.step_x),
                       fma(down.y, L::load(edges.step_y), down.z * L::load(edges.step_z)));
    return L::bits(max(half, -half) < broadcast<V>(0.5f * kFlat * field.far->error));
  }
  /// The sum over all balls in the lanes with a bit, `value` in the others.
  template <class V>
  PM_HD V exact_where(std::uint32_t lanes, V value, const Points<V>& at) const {
    if (F::kCompactSupport || lanes == 0) return value;
    alignas(32) float exact_sum[Lanes<V>::kCount], all[Lanes<V>::kCount];
    Lanes<V>::store(exact_sum, field_at<F>(at, field.balls, all_balls));
    Lanes<V>::store(all, value);
    for (int l = 0; l < Lanes<V>::kCount; ++l) all[l] = lanes >> l & 1u ? exact_sum[l] : all[l];
    return Lanes<V>::load(all);
  }
};

/// Balls as a source of PlaceVertices.
template <class F>
struct BallVertices {
  Grid grid;
  float iso = 1;
  float floor = 0;  ///< field values are clamped to at least this before the logarithm
  int margin = 0;   ///< of the bricks' level; above 0, the surface is not the exact field's anyway
  bool midpoint = false;
  View<const std::uint32_t> entries;
  View<const typename F::Ball> balls;
  // Where support is infinite:
  View<const FarField> far;  ///< of each brick
  BallList all_balls;

  PM_HD BallVertexField<F> field_of(const Node& brick, std::int64_t b) const {
    return {BrickField<F>(grid, margin, brick, balls.data, entries.data,
                          F::kCompactSupport ? nullptr : &far[b]),
            all_balls, iso, floor, !midpoint && margin == 0};
  }
};

/// Writes position and normal of each vertex. One team per brick. Source: field_of(brick, number).
template <class Source>
struct PlaceVertices {
  static constexpr int kThreads = 128;
  struct Scratch {
    std::uint16_t edges[kMaxVertices];  ///< kRowEdges row + bit, of each vertex
  };
  Grid grid;
  float iso = 1;
  int refine_steps = 1;
  bool midpoint = false;
  Source source;
  View<const Node> bricks;
  View<const float> values;
  View<const std::uint32_t> rows;
  View<const Counts> counts;
  View<const Offsets> first;
  View<Vec3> positions;
  View<Vec3> normals;

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t b) const {
    using V = typename Team::V;
    constexpr int kLanes = Lanes<V>::kCount;
    const auto count = static_cast<int>(counts[b].first);
    const std::int64_t out = first[b].first;
    if (count == 0 || out + count > positions.size) return;
    team.each(kRows, [&](int r) {
      const std::uint32_t row = rows[b * kRows + r];
      std::uint32_t to = row_before(row);
      for (std::uint32_t edges = row_edges(row); edges != 0; edges &= edges - 1) {
        scratch.edges[to++] = static_cast<std::uint16_t>(r * kRowEdges + countr_zero(edges));
      }
    });
    team.sync();
    const Node brick = bricks[b];
    const auto field = source.field_of(brick, b);
    team.each((count + kLanes - 1) / kLanes, [&](int item) {
      EdgeColumns<kLanes> edges;
      for (int l = 0; l < kLanes; ++l) {
        // The last item repeats its last edge.
        const int i = item * kLanes + l < count ? item * kLanes + l : count - 1;
        read_edge(brick.at, values.data + b * kBrickValues, scratch.edges[i], edges, l);
      }
      place<V>(edges, field, out + item * kLanes, count - item * kLanes);
    });
  }

  template <int kLanes>
  PM_HD void read_edge(Int3 brick, const float* value, int edge, EdgeColumns<kLanes>& out,
                       int l) const {
    const int row = edge / kRowEdges, axis = edge % 3;
    const int x = edge % kRowEdges / 3, y = row % kBrickCells, z = row / kBrickCells;
    const Int3 a = {brick.x * kBrickCells + x - 1, brick.y * kBrickCells + y - 1,
                    brick.z * kBrickCells + z - 1};
    const Vec3 from = grid_point(grid, a), to = grid_point(grid, {a.x + 1, a.y + 1, a.z + 1});
    out.x[l] = from.x, out.y[l] = from.y, out.z[l] = from.z;
    out.step_x[l] = axis == 0 ? to.x - from.x : 0.0f;
    out.step_y[l] = axis == 1 ? to.y - from.y : 0.0f;
    out.step_z[l] = axis == 2 ? to.z - from.z : 0.0f;
    out.axis[l] = axis;
    const int low = axis == 0 ? a.x : axis == 1 ? a.y : a.z;
    const int last = (axis == 0 ? grid.points.x : axis == 1 ? grid.points.y : grid.points.z) - 1;
    out.cut[l] = low < 0 || low == last;
    out.low[l] = low < 0 ? 1 - kEdgeMargin : kEdgeMargin;
    out.high[l] = low == last ? kEdgeMargin : 1 - kEdgeMargin;
    const int point = x + kBrickPoints * (y + kBrickPoints * z);
    out.value0[l] = value[point];
    out.value1[l] = value[point + (axis == 0   ? 1
                                   : axis == 1 ? kBrickPoints
                                               : kBrickPoints * kBrickPoints)];
  }

  template <class V>
  PM_HD static Points<V> along(const EdgeColumns<Lanes<V>::kCount>& edges, V t) {
    using L = Lanes<V>;
    return {fma(t, L::load(edges.step_x), L::load(edges.x)),
            fma(t, L::load(edges.step_y), L::load(edges.y)),
            fma(t, L::load(edges.step_z), L::load(edges.z))};
  }

  template <class V, class Field>
  PM_HD void place(const EdgeColumns<Lanes<V>::kCount>& edges, const Field& field, std::int64_t to,
                   int count) const {
    constexpr int kLanes = Lanes<V>::kCount;
    V t = midpoint ? broadcast<V>(0.5f) : find_root<V>(edges, field, 0);
    Points<V> at = along(edges, t), down = field.negated_gradient(at);
    const std::uint32_t flat = field.template flat_lanes<V>(edges, down);
    if (flat != 0) {
      t = find_root<V>(edges, field, flat);
      at = along(edges, t), down = field.negated_gradient(at);
    }
    const V length2 = fma(down.z, down.z, fma(down.y, down.y, down.x * down.x));
    const V length = sqrt(length2);
    alignas(32) float p[3][kLanes], n[3][kLanes];
    alignas(32) float square[kLanes];
    Lanes<V>::store(p[0], at.x), Lanes<V>::store(p[1], at.y), Lanes<V>::store(p[2], at.z);
    Lanes<V>::store(n[0], down.x / length), Lanes<V>::store(n[1], down.y / length);
    Lanes<V>::store(n[2], down.z / length), Lanes<V>::store(square, length2);
    for (int l = 0; l < kLanes && l < count; ++l) {
      positions[to + l] = {p[0][l], p[1][l], p[2][l]};
      Vec3 normal = {n[0][l], n[1][l], n[2][l]};
      // The cut at the border is flat; and where the field has no slope, the edge itself leads
      // outward.
      if (edges.cut[l] || !(square[l] > 1e-30f) || !(square[l] < 1e30f)) {
        const float sign = edges.value0[l] > iso ? 1.0f : -1.0f;
        const int axis = edges.axis[l];
        normal = {axis == 0 ? sign : 0.0f, axis == 1 ? sign : 0.0f, axis == 2 ? sign : 0.0f};
      }
      normals[to + l] = normal;
    }
  }

  /// Where along each edge the field is iso, as a fraction; by exact sums in flat lanes.
  template <class V, class Field>
  PM_HD V find_root(const EdgeColumns<Lanes<V>::kCount>& edges, const Field& field,
                    std::uint32_t flat) const {
    using L = Lanes<V>;
    V value0 = L::load(edges.value0), value1 = L::load(edges.value1);
    const V low = L::load(edges.low), high = L::load(edges.high);
    const V zero = broadcast<V>(0.0f), one = broadcast<V>(1.0f);
    value0 = field.exact_where(flat, value0, along(edges, zero));
    value1 = field.exact_where(flat, value1, along(edges, one));
    const V g0 = field.height(value0), g1 = field.height(value1);
    Bracket<V> b = {zero, g0, one, g1, one, g1};
    V t = min(max(b.line_root(), low), high);
    for (int s = 0; s < refine_steps; ++s) {
      const Points<V> at = along(edges, t);
      const V value = field.exact_where(flat, field.value(at), at);
      const V g = field.height(value);
      const auto lower = (value > iso) == (value0 > iso);
      b = {select(lower, t, b.t0), select(lower, g, b.g0),    select(lower, b.t1, t),
           select(lower, b.g1, g), select(lower, b.t0, b.t1), select(lower, b.g0, b.g1)};
      // Closer than this, differences between the points would be rounding noise.
      const auto there = (g < kCloseEnough) & (-g < kCloseEnough);
      t = select(there, t, min(max(b.parabola_root(), low), high));
    }
    return t;
  }
};

}  // namespace polymorph
