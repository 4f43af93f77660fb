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
PM_HD inline float smoothstep_slope(float t) {
  const float x = min(max(t, 0.0f), 1.0f);
  return 6 * x * (1 - x);
}

/// Signed distances as a field of level_set.h, trilinear between the grid's points. At a distance b
/// beyond the grid, where the nearest border point has the value d, the value is -sqrt(b^2 + d^2),
/// so that the Lipschitz constant holds everywhere.
///
/// An object's detail is the difference between its distances and smoothed distances, which are
/// optional. A morph fades it in and out (morph_field.h).
struct DistanceField {
  Vec3 origin;
  float cell = 1, inv_cell = 1;
  Vec3 last;                         ///< points - 1 along each axis
  std::uint32_t row = 1, layer = 1;  ///< index steps along y and z
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
        row(static_cast<std::uint32_t>(grid.points.x)),
        layer(static_cast<std::uint32_t>(grid.points.x) *
              static_cast<std::uint32_t>(grid.points.y)),
        values(data) {}

  /// Adds smoothed distances, and the progress at which the detail fades.
  void set_detail(const float* smoothed, const DetailFade& fade) {
    smooth = smoothed;
    fade_end = fade.end;
    fade_scale = 1 / (fade.end - fade.begin);
  }

  template <class V>
  PM_HD V value(const Points<V>& p) const {
    const CellPosition<V> position = locate(p);
    return interpolate(values, position);
  }

  /// Evaluates the smoothed distances plus a fraction `detail` in [0, 1] of the detail.
  template <class V>
  PM_HD V value(const Points<V>& p, V detail) const {
    const CellPosition<V> position = locate(p);
    // Most points have all of the detail or none, so that one of the two grids is enough.
    if (!smooth || Lanes<V>::bits(detail < 1.0f) == 0) return interpolate(values, position);
    const V smoothed = interpolate(smooth, position);
    if (Lanes<V>::bits(detail > 0.0f) == 0) return smoothed;
    const V detailed = interpolate(values, position);
    // Each lane must get the bits that it would get alone, so lanes with no detail or with all of
    // it skip the fma, which rounds and would turn -0 into +0.
    const V mixed = select(detail > 0.0f, fma(detail, detailed - smoothed, smoothed), smoothed);
    return select(detail < 1.0f, mixed, detailed);
  }

  /// Returns the fraction of its detail that an object keeps at `progress`, which is 0 at the
  /// object's own end of the morph.
  template <class V>
  PM_HD V detail_share(V progress) const {
    return smoothstep((fade_end - progress) * fade_scale);
  }
  /// Returns the derivative of detail_share().
  PM_HD float detail_share_slope(float progress) const {
    return -fade_scale * smoothstep_slope((fade_end - progress) * fade_scale);
  }

  /// Returns the detail at p: the distance less the smoothed distance.
  template <class V>
  PM_HD V detail(const Points<V>& p) const {
    if (!smooth) return broadcast<V>(0.0f);
    const CellPosition<V> position = locate(p);
    return interpolate(values, position) - interpolate(smooth, position);
  }

  template <class V>
  PM_HD V line_values(const Grid& grid, Int3 start) const {
    return value(line_points<V>(grid, start));
  }

  /// Returns the gradient of value(p, detail), by central differences over two cells.
  template <class V>
  PM_HD Points<V> gradient(const Points<V>& p, V detail) const {
    const auto slope = [&](float dx, float dy, float dz) {
      const Points<V> high = {p.x + dx, p.y + dy, p.z + dz}, low = {p.x - dx, p.y - dy, p.z - dz};
      return (value(high, detail) - value(low, detail)) * (0.5f * inv_cell);
    };
    return {slope(cell, 0, 0), slope(0, cell, 0), slope(0, 0, cell)};
  }
  template <class V>
  PM_HD Points<V> negated_gradient(const Points<V>& p) const {
    const Points<V> g = gradient(p, broadcast<V>(1.0f));
    return {0.0f - g.x, 0.0f - g.y, 0.0f - g.z};  // never -0
  }

 private:
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
  PM_HD CellPosition<V> locate(const Points<V>& p) const {
    CellPosition<V> position;
    position.distance2 = broadcast<V>(0.0f);
    const auto x = find_cell(p.x, origin.x, last.x, position.x, position.distance2);
    const auto y = find_cell(p.y, origin.y, last.y, position.y, position.distance2);
    const auto z = find_cell(p.z, origin.z, last.z, position.z, position.distance2);
    position.index = x + y * row + z * layer;
    return position;
  }

  /// Interpolates trilinearly; beyond the grid, returns -sqrt(b^2 + d^2).
  template <class V>
  PM_HD V interpolate(const float* data, const CellPosition<V>& position) const {
    const auto interpolate_x = [&](std::uint32_t offset) {
      V a, b;
      gather_pairs(data + offset, position.index, a, b);
      return fma(position.x, b - a, a);
    };
    const V near_low = interpolate_x(0), near_high = interpolate_x(row);
    const V far_low = interpolate_x(layer), far_high = interpolate_x(layer + row);
    const V near = fma(position.y, near_high - near_low, near_low);
    const V far = fma(position.y, far_high - far_low, far_low);
    const V inside = fma(position.z, far - near, near);
    if (Lanes<V>::bits(position.distance2 > 0.0f) == 0) return inside;
    const V in_cells = inside * inv_cell;
    const V outside = -(cell * sqrt(position.distance2 + in_cells * in_cells));
    return select(position.distance2 > 0.0f, outside, inside);
  }

  /// Returns the cell of coordinate p along an axis, computes the fraction t within it, and adds to
  /// the squared distance from the grid.
  template <class V>
  PM_HD auto find_cell(V p, float first, float last_point, V& t, V& distance2) const {
    const V u = (p - first) * inv_cell;
    const V clamped = min(max(u, broadcast<V>(0.0f)), broadcast<V>(last_point));
    const V beyond = u - clamped;
    distance2 = fma(beyond, beyond, distance2);
    const V below = min(max(round_to_nearest(clamped - 0.5f), broadcast<V>(0.0f)),
                        broadcast<V>(last_point - 1));
    t = clamped - below;
    return to_index(below);
  }
};

/// Bounds of a DistanceField (level_set.h) by its Lipschitz constant.
struct DistanceBounds {
  struct Local {};
  DistanceField field;
  float lipschitz = 1;
  float rounding = 0;  ///< a generous bound of all rounding errors

  template <class Team>
  PM_HD Local local(const Team&, const NodeBox&) const {
    return {};
  }
  template <class V>
  PM_HD std::uint32_t crossing_boxes(const Points<V>& middle, Vec3 half, Local,
                                     bool has_rim) const {
    const V distance = field.value(middle);
    const float max_change = 1.001f * lipschitz * sqrt(dot(half, half)) + rounding;
    const std::uint32_t inside = Lanes<V>::bits(distance > -max_change);
    return has_rim ? inside : inside & Lanes<V>::bits(distance <= max_change);
  }
};

}  // namespace polymorph
