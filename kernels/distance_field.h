// Signed distance field: trilinear interpolation of an object's distances on a grid.
#pragma once

#include <cstdint>

#include "field.h"
#include "host_device.h"
#include "morph_surface.h"
#include "simd_math.h"
#include "tree.h"
#include "types.h"

namespace polymorph {

/// Returns 3 t^2 - 2 t^3, with t clamped to [0, 1].
template <class V>
PM_HD V smoothstep(V t) {
  const V x = min(max(t, broadcast<V>(0.0f)), broadcast<V>(1.0f));
  return x * x * (3.0f - 2.0f * x);
}
/// Returns the derivative of smoothstep().
template <class V>
PM_HD V smoothstep_slope(V t) {
  const V x = min(max(t, broadcast<V>(0.0f)), broadcast<V>(1.0f));
  return 6.0f * x * (1.0f - x);
}

/// Signed distances as a field of level_set.h, interpolated trilinearly between the grid's points.
/// A point at a distance b from the grid, whose nearest point on the border has the value d, has
/// the value -sqrt(b^2 + d^2), so that the Lipschitz constant holds everywhere.
///
/// An object's detail is the difference between its distances and smoothed distances, which are
/// optional. A morph fades it in and out (morph_field.h).
struct DistanceField {
  static constexpr bool kHasHalves = false;  // level_set.h
  Vec3 origin;
  float cell = 1, inv_cell = 1;
  Vec3 last;                        ///< points - 1 along each axis
  std::int32_t row = 1, layer = 1;  ///< index steps along y and z
  const float* values = nullptr;
  const float* smooth = nullptr;       ///< smoothed distances at the same points; null: no detail
  float fade_end = 1, fade_scale = 1;  ///< DetailFade: its end, and 1 / (end - begin)

  DistanceField() = default;
  DistanceField(const Grid& grid, const float* data)
      : origin(grid.origin),
        cell(grid.cell),
        inv_cell(1 / grid.cell),
        last{static_cast<float>(grid.points.x - 1), static_cast<float>(grid.points.y - 1),
             static_cast<float>(grid.points.z - 1)},
        row(grid.points.x),
        layer(grid.points.x * grid.points.y),
        values(data) {}

  /// Adds smoothed distances, and the progress at which the detail fades.
  void set_detail(const float* smoothed, const DetailFade& fade) {
    smooth = smoothed;
    fade_end = fade.end;
    fade_scale = 1 / (fade.end - fade.begin);
  }

  template <class V>
  PM_HD V value(const Points<V>& p) const {
    return interpolate(values, locate(p));
  }

  /// Evaluates the smoothed distances plus a fraction `detail` in [0, 1] of the detail.
  template <class V>
  PM_HD V value(const Points<V>& p, V detail) const {
    const CellPosition<V> position = locate(p);
    // Most points have all of the detail or none, so that one of the two grids is enough.
    if (has_all_detail(detail)) return interpolate(values, position);
    const V smoothed = interpolate(smooth, position);
    if (has_no_detail(detail)) return smoothed;
    return mix_detail(detail, interpolate(values, position), smoothed);
  }

  /// The least and the greatest value(p, detail) for `detail` between two fractions.
  template <class V>
  struct Range {
    V low, high;
  };
  template <class V>
  PM_HD Range<V> value_range(const Points<V>& p, V low_detail, V high_detail) const {
    const CellPosition<V> position = locate(p);
    if (has_all_detail(low_detail)) {
      const V detailed = interpolate(values, position);
      return {detailed, detailed};
    }
    const V smoothed = interpolate(smooth, position);
    if (has_no_detail(high_detail)) return {smoothed, smoothed};
    const V detailed = interpolate(values, position);
    const V a = mix_detail(low_detail, detailed, smoothed),
            b = mix_detail(high_detail, detailed, smoothed);
    return {min(a, b), max(a, b)};
  }

  /// Returns the fraction of its detail that an object keeps at `progress`, which is 0 at the
  /// object's own end of the morph.
  template <class V>
  PM_HD V detail_share(V progress) const {
    return smoothstep((fade_end - progress) * fade_scale);
  }
  /// Returns the derivative of detail_share() by `progress`.
  template <class V>
  PM_HD V detail_share_slope(V progress) const {
    return -fade_scale * smoothstep_slope((fade_end - progress) * fade_scale);
  }

#if defined(PM_PACKS)
  /// Prefetches the distances in a box with these corners, which will be read soon: those with
  /// detail, the smoothed ones, or both. Rows and layers lie far apart in memory, so that most
  /// distances are not in the caches yet.
  void prefetch(const Points<Pack>& corners, bool detailed, bool smoothed) const {
    const auto range = [&](Pack p, float first, float last_point, int(&out)[2]) {
      const PackBits index = find_cell(p, first, last_point).index;
      out[0] = out[1] = static_cast<int>(index[0]);
      for (int l = 1; l < 8; ++l) {
        const auto at = static_cast<int>(index[l]);
        out[0] = at < out[0] ? at : out[0];
        out[1] = at > out[1] ? at : out[1];
      }
      ++out[1];  // a cell ends at the next point
    };
    int x[2], y[2], z[2];
    range(corners.x, origin.x, last.x, x);
    range(corners.y, origin.y, last.y, y);
    range(corners.z, origin.z, last.z, z);
    // A box with more rows of cells is not prefetched, because the sampled points of a brick read
    // only some of them.
    constexpr int kMaxRows = 100;
    if ((y[1] - y[0]) * (z[1] - z[0]) > kMaxRows) return;
    constexpr int kLine = 16;  // floats in a cache line
    for (int k = z[0]; k <= z[1]; ++k) {
      for (int j = y[0]; j <= y[1]; ++j) {
        const std::int64_t at = std::int64_t{layer} * k + std::int64_t{row} * j;
        // The last step takes the row's last value, which may lie in one cache line more.
        for (int i = x[0]; i < x[1] + kLine; i += kLine) {
          const std::int64_t point = at + (i < x[1] ? i : x[1]);
          if (detailed) prefetch_line(values + point);
          if (smoothed) prefetch_line(smooth + point);
        }
      }
    }
  }
#endif

#if defined(PM_PACKS)
  /// Prefetches the distances that value(p) reads at the points of the brick from `first` on.
  void prefetch(const Grid& point_grid, Int3 first) const {
    prefetch(brick_corners(point_grid, first), /*detailed=*/true, /*smoothed=*/false);
  }
#endif

  struct BrickScratch {};
  /// Evaluates value() at the points of a brick (level_set.h).
  template <class V>
  struct BrickValues {
    const DistanceField& field;
    Grid grid;
    Int3 first;
    template <class Team>
    PM_HD BrickValues(const Team&, BrickScratch&, const DistanceField& of_field,
                      const Grid& of_grid, Int3 first_point)
        : field(of_field), grid(of_grid), first(first_point) {}
    PM_HD V operator()(int item) const { return field.value(brick_points<V>(grid, first, item)); }
  };
#if defined(PM_PACKS)
  /// The field at points of a box (level_set.h).
  struct PackBox {
    struct Scratch {};
    const DistanceField& field;
    BoxPoints points;
    PackBox(Scratch&, const DistanceField& of_field, const BoxPoints& box)
        : field(of_field), points(box) {}
    void add_lines(std::uint64_t) const {}
    template <class V>
    V value(const std::uint32_t* at) const {
      return field.value(points.at<V>(at));
    }
  };
#endif

  /// The value(p, detail), its gradient by central differences over two cells, and its derivative
  /// by `detail`, which is the distance less the smoothed one, or 0 without smoothed distances.
  template <class V>
  struct Slope {
    V value;
    Points<V> gradient;
    V detail_derivative;
  };
  template <class V>
  PM_HD Slope<V> slope(const Points<V>& p, V detail) const {
    const Stencil<V> stencil = stencil_at(p);
    // With all of the detail or none, the other grid's distance is needed at p alone.
    const bool all_detail = has_all_detail(detail),
               no_detail = !all_detail && has_no_detail(detail);
    V detailed[7], smoothed[7], mixed[7];
    if (no_detail)
      detailed[0] = interpolate(values, stencil.positions[0]);
    else
      interpolate(values, stencil, detailed);
    if (smooth && all_detail)
      smoothed[0] = interpolate(smooth, stencil.positions[0]);
    else if (smooth)
      interpolate(smooth, stencil, smoothed);
    for (int i = 0; i < 7; ++i) {
      mixed[i] = all_detail  ? detailed[i]
                 : no_detail ? smoothed[i]
                             : mix_detail(detail, detailed[i], smoothed[i]);
    }
    const V scale = broadcast<V>(0.5f * inv_cell);
    return {mixed[0],
            {(mixed[1] - mixed[2]) * scale, (mixed[3] - mixed[4]) * scale,
             (mixed[5] - mixed[6]) * scale},
            smooth ? detailed[0] - smoothed[0] : broadcast<V>(0.0f)};
  }

  template <class V>
  PM_HD Points<V> negated_gradient(const Points<V>& p) const {
    const Points<V> g = slope(p, broadcast<V>(1.0f)).gradient;
    return {0.0f - g.x, 0.0f - g.y, 0.0f - g.z};  // never -0
  }

 private:
  template <class V>
  PM_HD bool has_all_detail(V detail) const {
    return !smooth || Lanes<V>::bits(detail < 1.0f) == 0;
  }
  template <class V>
  PM_HD static bool has_no_detail(V detail) {
    return Lanes<V>::bits(detail > 0.0f) == 0;
  }
  /// Mixes distances and smoothed distances. Each lane must get the bits that it would get alone,
  /// so lanes with no detail or with all of it do not take the result of the fma, which rounds and
  /// would turn -0 into +0.
  template <class V>
  PM_HD static V mix_detail(V detail, V detailed, V smoothed) {
    const V mixed = select(detail > 0.0f, fma(detail, detailed - smoothed, smoothed), smoothed);
    return select(detail < 1.0f, mixed, detailed);
  }

  /// The cell of a coordinate along an axis: its index, the coordinate within it in [0, 1], and how
  /// far the coordinate is beyond the grid, in cells.
  template <class V>
  struct AxisCell {
    decltype(to_index(V{})) index;
    V fraction, beyond;
  };
  template <class V>
  PM_HD AxisCell<V> find_cell(V p, float first, float last_point) const {
    const V u = (p - first) * inv_cell;
    const V clamped = min(max(u, broadcast<V>(0.0f)), broadcast<V>(last_point));
    // Rounding u - 1/2 gives the cell of u or, at a point of the grid, either neighbouring cell.
    const V below = min(max(round_to_nearest(clamped - 0.5f), broadcast<V>(0.0f)),
                        broadcast<V>(last_point - 1));
    return {to_index(below), clamped - below, u - clamped};
  }

  /// The cell of a point, its coordinates within the cell in [0, 1], and its distance from the
  /// grid.
  template <class V>
  struct CellPosition {
    using Index = decltype(to_index(V{}));
    Index index;  ///< index of the cell's lowest point
    V x, y, z;
    V distance2;  ///< squared distance from the grid, in cells
  };
  template <class V>
  PM_HD CellPosition<V> join_axes(const AxisCell<V>& x, const AxisCell<V>& y,
                                  const AxisCell<V>& z) const {
    const V distance2 = fma(z.beyond, z.beyond, fma(y.beyond, y.beyond, x.beyond * x.beyond));
    return {x.index + y.index * static_cast<std::uint32_t>(row) +
                z.index * static_cast<std::uint32_t>(layer),
            x.fraction, y.fraction, z.fraction, distance2};
  }
  template <class V>
  PM_HD CellPosition<V> locate(const Points<V>& p) const {
    return join_axes(find_cell(p.x, origin.x, last.x), find_cell(p.y, origin.y, last.y),
                     find_cell(p.z, origin.z, last.z));
  }

  /// Interpolates `data` trilinearly; beyond the grid, returns -sqrt(b^2 + d^2).
  template <class V>
  PM_HD V interpolate(const float* data, const CellPosition<V>& position) const {
    const std::int32_t offsets[4] = {0, row, layer, layer + row};
    V rows[4][2];
    gather_rows(data, position.index, offsets, rows);
    return interpolate(position, rows[0], rows[1], rows[2], rows[3]);
  }
  /// Interpolates between the cell's eight corners, which are four pairs along x: `low` and `high`
  /// mean the cell's lower and upper y, `near` and `far` its lower and upper z.
  template <class V>
  PM_HD V interpolate(const CellPosition<V>& position, const V* near_low, const V* near_high,
                      const V* far_low, const V* far_high) const {
    const auto along_x = [&](const V* pair) { return fma(position.x, pair[1] - pair[0], pair[0]); };
    const V low = along_x(near_low), near = fma(position.y, along_x(near_high) - low, low);
    const V low_far = along_x(far_low), far = fma(position.y, along_x(far_high) - low_far, low_far);
    const V inside = fma(position.z, far - near, near);
    if (Lanes<V>::bits(position.distance2 > 0.0f) == 0) return inside;
    const V in_cells = inside * inv_cell;
    const V outside = -(cell * sqrt(position.distance2 + in_cells * in_cells));
    return select(position.distance2 > 0.0f, outside, inside);
  }

  /// The points of a gradient's differences: p, and the points one cell above and below it along x,
  /// y and z.
  template <class V>
  struct Stencil {
    CellPosition<V> positions[7];
    /// True if the six points' cells are the neighbours of the cell of p in all lanes.
    bool adjacent;
  };
  template <class V>
  PM_HD Stencil<V> stencil_at(const Points<V>& p) const {
    const AxisCell<V> x = find_cell(p.x, origin.x, last.x), y = find_cell(p.y, origin.y, last.y),
                      z = find_cell(p.z, origin.z, last.z);
    Stencil<V> out;
    out.positions[0] = join_axes(x, y, z);
    out.positions[1] = join_axes(find_cell(p.x + cell, origin.x, last.x), y, z);
    out.positions[2] = join_axes(find_cell(p.x - cell, origin.x, last.x), y, z);
    out.positions[3] = join_axes(x, find_cell(p.y + cell, origin.y, last.y), z);
    out.positions[4] = join_axes(x, find_cell(p.y - cell, origin.y, last.y), z);
    out.positions[5] = join_axes(x, y, find_cell(p.z + cell, origin.z, last.z));
    out.positions[6] = join_axes(x, y, find_cell(p.z - cell, origin.z, last.z));
    const auto index = out.positions[0].index;
    const auto is_adjacent = [&](int i, std::int32_t cells) {
      const auto step = static_cast<std::uint32_t>(cells);
      return (out.positions[i].index == index + step) &
             (out.positions[i + 1].index + step == index);
    };
    constexpr std::uint32_t kAllLanes = (1u << Lanes<V>::kCount) - 1;
    out.adjacent = Lanes<V>::bits(is_adjacent(1, 1) & is_adjacent(3, row) &
                                  is_adjacent(5, layer)) == kAllLanes;
    return out;
  }
  /// Interpolates at the points of a stencil. Neighbouring cells share most of their corners, which
  /// are loaded once. The comments below give corners relative to the lowest corner of p's cell.
  template <class V>
  PM_HD void interpolate(const float* data, const Stencil<V>& stencil, V (&out)[7]) const {
    const CellPosition<V>* at = stencil.positions;
    if (!stencil.adjacent) {
      for (int i = 0; i < 7; ++i) out[i] = interpolate(data, at[i]);
      return;
    }
    // x = -1 to 2, in four rows: (y, z) = (0, 0), (1, 0), (0, 1), (1, 1).
    const std::int32_t along_x[4] = {-1, row - 1, layer - 1, layer + row - 1};
    V rows[4][4];
    gather_rows(data, at[0].index, along_x, rows);
    out[0] = interpolate(at[0], rows[0] + 1, rows[1] + 1, rows[2] + 1, rows[3] + 1);
    out[1] = interpolate(at[1], rows[0] + 2, rows[1] + 2, rows[2] + 2, rows[3] + 2);
    out[2] = interpolate(at[2], rows[0], rows[1], rows[2], rows[3]);
    // x = 0 and 1, in four rows: (y, z) = (2, 0), (2, 1), (-1, 0), (-1, 1).
    const std::int32_t along_y[4] = {2 * row, layer + 2 * row, -row, layer - row};
    V pairs[4][2];
    gather_rows(data, at[0].index, along_y, pairs);
    out[3] = interpolate(at[3], rows[1] + 1, pairs[0], rows[3] + 1, pairs[1]);
    out[4] = interpolate(at[4], pairs[2], rows[0] + 1, pairs[3], rows[2] + 1);
    // x = 0 and 1, in four rows: (y, z) = (0, 2), (1, 2), (0, -1), (1, -1).
    const std::int32_t along_z[4] = {2 * layer, 2 * layer + row, -layer, row - layer};
    gather_rows(data, at[0].index, along_z, pairs);
    out[5] = interpolate(at[5], rows[2] + 1, rows[3] + 1, pairs[0], pairs[1]);
    out[6] = interpolate(at[6], pairs[2], pairs[3], rows[0] + 1, rows[1] + 1);
  }
};

/// Bounds of a DistanceField (level_set.h) by its Lipschitz constant.
struct DistanceBounds {
  static constexpr bool kHasHalves = false;  // level_set.h
  struct Local {};
  DistanceField field;
  float lipschitz = 1;
  float rounding = 0;  ///< distance_rounding() of the surface's grid

  template <class Team>
  PM_HD Local local(const Team&, const NodeBox&) const {
    return {};
  }
  template <class V>
  PM_HD std::uint32_t crossing_boxes(const Points<V>& middle, Vec3 half, Local,
                                     bool has_rim) const {
    const Sides can_be = sides(field.value(middle), half);
    return has_rim ? can_be.inside : can_be.inside & can_be.outside;
  }
#if defined(PM_PACKS)
  template <class V>
  Sides sides(const DistanceField::PackBox& box, const std::uint32_t* middles, Vec3 half,
              Local) const {
    return sides(box.value<V>(middles), half);
  }
#endif

 private:
  /// Returns the sides on which boxes can have points that have these distances in their middles.
  template <class V>
  PM_HD Sides sides(V distance, Vec3 half) const {
    const float max_change = 1.001f * lipschitz * sqrt(dot(half, half)) + rounding;
    return {Lanes<V>::bits(distance > -max_change), Lanes<V>::bits(distance <= max_change)};
  }
};

}  // namespace polymorph
