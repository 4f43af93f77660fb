// Places one vertex on each crossed edge: a root of log2(field / iso) along the edge, and the
// normal there.
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
#include "cells.h"
#include "field.h"
#include "host_device.h"
#include "math.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// A vertex keeps this fraction of an edge away from the edge's ends: the vertices around one grid
/// point stay apart, at most 0.2 % of a cell from where they belong.
constexpr float kEdgeMargin = 1.0f / 512.0f;

/// |log2(field / iso)| at which a vertex needs no further step: some ten times the rounding of the
/// field.
constexpr float kCloseEnough = 0x1p-17f;

/// One vertex to place; those of a brick stand together, padded to whole items.
struct VertexJob {
  std::uint32_t vertex = 0;
  std::uint32_t brick = 0;
  std::uint32_t edge = 0;  ///< 3 (x + 4 (y + 4 z)) + axis of the lower point
};
constexpr std::uint32_t kNoVertex = 0xffffffffu;  ///< padding

/// Counts the jobs of each brick, rounded up to a multiple of kLanes. One item a brick.
template <int kLanes>
struct CountJobs {
  View<const Node> bricks;
  RowOrder order;
  View<const std::uint8_t> vertices;  ///< of each row
  View<std::uint32_t> jobs;

  PM_HD void operator()(std::int64_t brick) const {
    if (brick >= bricks.size) return;
    std::uint32_t count = 0;
    for (int r = 0; r < kRows; ++r) {
      count += vertices[order(bricks[brick].index, static_cast<std::uint32_t>(brick),
                              r % kBrickCells, r / kBrickCells)];
    }
    jobs[brick] = (count + kLanes - 1) / kLanes * kLanes;
  }
};

/// Writes the jobs of each brick. One item a brick.
struct EmitJobs {
  View<const Node> bricks;
  VertexNumbers numbers;
  View<const std::int64_t> first;  ///< job of each brick
  View<VertexJob> jobs;

  PM_HD void operator()(std::int64_t brick) const {
    if (brick >= bricks.size) return;
    std::int64_t out = first[brick];
    const auto number = static_cast<std::uint32_t>(brick);
    VertexJob job;
    for (int r = 0; r < kRows; ++r) {
      const std::int64_t row =
          numbers.order(bricks[brick].index, number, r % kBrickCells, r / kBrickCells);
      std::uint32_t vertex = static_cast<std::uint32_t>(numbers.first[row]);
      const std::uint32_t mask = numbers.masks[row];
      for (int bit = 0; bit < kRowEdges; ++bit) {
        if (!(mask >> bit & 1u)) continue;
        job = {vertex++, number, static_cast<std::uint32_t>(r * kRowEdges + bit)};
        jobs[out++] = job;
      }
    }
    job.vertex = kNoVertex;
    while (out < first[brick + 1]) jobs[out++] = job;
  }
};

/// Writes position and normal of each vertex. One item kLanes jobs of one brick.
template <class F, int kLanes>
struct PlaceVertices {
  Grid grid;
  float iso = 1;
  float floor = 0;  ///< field values are held above this before the logarithm
  int refine_steps = 1;
  Int3 brick_nodes;
  View<const Node> bricks;
  View<const std::uint32_t> entries;
  View<const typename F::Ball> balls;
  View<const float> values;
  View<const VertexJob> jobs;
  View<Vec3> positions;
  View<Vec3> normals;

  /// The edges of an item, one a lane.
  struct Edges {
    Points<kLanes> start;  ///< lower end
    float step[kLanes];    ///< length
    int axis[kLanes];
    float fixed[kLanes];                   ///< where the rim cuts this edge (fraction), or < 0
    float value0[kLanes], value1[kLanes];  ///< field at the ends
  };

  PM_HD void operator()(std::int64_t item) const {
    const std::int64_t base = item * kLanes;
    if (base >= jobs.size) return;
    const Node brick = bricks[jobs[base].brick];
    const BallList list = {entries.data + brick.begin, brick.count};
    const Edges edges = edges_of(base, brick);
    float t[kLanes];
    find_roots(edges, list, t);
    Points<kLanes> at, outward;
    along(edges, t, at);
    downhill_at<F>(at, balls.data, list, outward);
    for (int l = 0; l < kLanes; ++l) {
      const std::uint32_t vertex = jobs[base + l].vertex;
      if (vertex == kNoVertex) continue;
      positions[vertex] = {at.x[l], at.y[l], at.z[l]};
      normals[vertex] = normal_of(edges, l, {outward.x[l], outward.y[l], outward.z[l]});
    }
  }

  PM_HD Edges edges_of(std::int64_t base, const Node& brick) const {
    Edges out;
    const Int3 p = node_position(brick_nodes, brick.index);
    for (int l = 0; l < kLanes; ++l) {
      const VertexJob job = jobs[base + l];
      const int axis = static_cast<int>(job.edge % 3), i = static_cast<int>(job.edge / 3);
      const int x = i % kBrickCells, y = i / kBrickCells % kBrickCells,
                z = i / kBrickCells / kBrickCells;
      const Int3 a = {p.x * kBrickCells + x - 1, p.y * kBrickCells + y - 1,
                      p.z * kBrickCells + z - 1};
      const Int3 b = {a.x + (axis == 0), a.y + (axis == 1), a.z + (axis == 2)};
      const Vec3 from = grid_point(grid, a), to = grid_point(grid, b);
      out.start.x[l] = from.x, out.start.y[l] = from.y, out.start.z[l] = from.z;
      out.step[l] = axis == 0 ? to.x - from.x : axis == 1 ? to.y - from.y : to.z - from.z;
      out.axis[l] = axis;
      const int low = axis == 0 ? a.x : axis == 1 ? a.y : a.z;
      const int last = (axis == 0 ? grid.points.x : axis == 1 ? grid.points.y : grid.points.z) - 1;
      out.fixed[l] = low < 0 ? 1 - kEdgeMargin : low == last ? kEdgeMargin : -1.0f;
      const float* value = values.data + static_cast<std::int64_t>(job.brick) * kBrickStride;
      out.value0[l] = value[local_point(x, y, z)];
      out.value1[l] = value[local_point(x + (axis == 0), y + (axis == 1), z + (axis == 2))];
    }
    return out;
  }

  PM_HD void along(const Edges& edges, const float (&t)[kLanes], Points<kLanes>& at) const {
    for (int l = 0; l < kLanes; ++l) {
      const float x = edges.axis[l] == 0 ? edges.step[l] : 0.0f;
      const float y = edges.axis[l] == 1 ? edges.step[l] : 0.0f;
      const float z = edges.axis[l] == 2 ? edges.step[l] : 0.0f;
      at.x[l] = fused(t[l], x, edges.start.x[l]);
      at.y[l] = fused(t[l], y, edges.start.y[l]);
      at.z[l] = fused(t[l], z, edges.start.z[l]);
    }
  }

  /// Two points of log2(field / iso) along an edge with opposite signs, and a third one.
  struct Bracket {
    float t0, g0, t1, g1, t2, g2;
  };

  PM_HD void find_roots(const Edges& edges, BallList list, float (&t)[kLanes]) const {
    Bracket bracket[kLanes];
    const float level = log_of_two(iso);
    for (int l = 0; l < kLanes; ++l) {
      const float g0 = log_of_two(most(edges.value0[l], floor)) - level;
      const float g1 = log_of_two(most(edges.value1[l], floor)) - level;
      bracket[l] = {0, g0, 1, g1, 1, g1};
      t[l] = kept_apart(line_root(bracket[l]), edges.fixed[l]);
    }
    for (int s = 0; s < refine_steps; ++s) {
      Points<kLanes> at;
      float value[kLanes];
      along(edges, t, at);
      field_at<F>(at, balls.data, list, value);
      for (int l = 0; l < kLanes; ++l) {
        const float g = log_of_two(most(value[l], floor)) - level;
        const Bracket b = bracket[l];
        const bool lower = (value[l] > iso) == (edges.value0[l] > iso);
        bracket[l] = lower ? Bracket{t[l], g, b.t1, b.g1, b.t0, b.g0}
                           : Bracket{b.t0, b.g0, t[l], g, b.t1, b.g1};
        // Closer than this, differences between the points would be rounding noise.
        const bool there = g < kCloseEnough && -g < kCloseEnough;
        t[l] = there ? t[l] : kept_apart(parabola_root(bracket[l]), edges.fixed[l]);
      }
    }
  }

  /// Keeps a vertex within the margins of its edge, or where the rim wants it.
  PM_HD static float kept_apart(float t, float fixed) {
    return fixed >= 0 ? fixed : least(most(t, kEdgeMargin), 1 - kEdgeMargin);
  }

  PM_HD static float line_root(const Bracket& b) {
    const float rise = b.g0 - b.g1;
    // Equal logarithms of different values: both within rounding of iso.
    const float s = rise != 0 ? b.g0 / rise : 0.5f;
    return fused(b.t1 - b.t0, least(most(s, 0.0f), 1.0f), b.t0);
  }

  /// The root inside the bracket of the parabola through the three points; where rounding leaves
  /// none there, that of the line.
  PM_HD static float parabola_root(const Bracket& b) {
    const float h = b.t1 - b.t0, h2 = b.t2 - b.t0;
    const float slope = (b.g1 - b.g0) / h;
    const float bend = ((b.g2 - b.g0) / h2 - slope) / (b.t2 - b.t1);
    // bend s^2 + linear s + g0 = 0 with s = t - t0; at the root the slope has the sign of g1 - g0.
    const float linear = fused(-bend, h, slope);
    const float root = square_root(most(fused(linear, linear, -4 * bend * b.g0), 0.0f));
    const float s = -2 * b.g0 / (linear + (slope < 0 ? -root : root));
    return s >= 0 && s <= h ? b.t0 + s : line_root(b);
  }

  PM_HD Vec3 normal_of(const Edges& edges, int lane, Vec3 outward) const {
    const float length2 =
        fused(outward.z, outward.z, fused(outward.y, outward.y, outward.x * outward.x));
    // The cut at the border is flat; and where the field has no slope, the edge itself leads
    // outward.
    if (edges.fixed[lane] >= 0 || !(length2 > 1e-30f) || !(length2 < 1e30f)) {
      const float sign = edges.value0[lane] > iso ? 1.0f : -1.0f;
      const int axis = edges.axis[lane];
      return {axis == 0 ? sign : 0.0f, axis == 1 ? sign : 0.0f, axis == 2 ? sign : 0.0f};
    }
    return outward / square_root(length2);
  }
};

}  // namespace polymorph
