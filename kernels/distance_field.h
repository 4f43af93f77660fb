// Signed distance field: trilinear interpolation of an object's distances on a grid.
#pragma once

#include <cstdint>

#include "field.h"
#include "host_device.h"
#include "morph_surface.h"
#include "simd_math.h"
#include "types.h"

namespace polymorph {

/// The distances as a function of space: trilinear between the grid's points, and beyond the grid
/// the hypotenuse of the distance on its border and the distance from there, so that the Lipschitz
/// constant holds everywhere.
struct DistanceField {
  Vec3 origin;
  float cell = 1, per_cell = 1;
  Vec3 last;  ///< points - 1 along each axis
  std::uint32_t row = 1, layer = 1;
  const float* values = nullptr;

  DistanceField() = default;
  DistanceField(const Grid& grid, const float* data)
      : origin(grid.origin),
        cell(grid.cell),
        per_cell(1 / grid.cell),
        last{static_cast<float>(grid.points.x - 1), static_cast<float>(grid.points.y - 1),
             static_cast<float>(grid.points.z - 1)},
        row(static_cast<std::uint32_t>(grid.points.x)),
        layer(static_cast<std::uint32_t>(grid.points.x) *
              static_cast<std::uint32_t>(grid.points.y)),
        values(data) {}

  template <class V>
  PM_HD V at(const Points<V>& p) const {
    V beyond = broadcast<V>(0.0f);
    V tx, ty, tz;
    const auto x = along(p.x, origin.x, last.x, tx, beyond);
    const auto y = along(p.y, origin.y, last.y, ty, beyond);
    const auto z = along(p.z, origin.z, last.z, tz, beyond);
    const auto i = x + y * row + z * layer;
    const auto pair = [&](std::uint32_t offset) {
      const V a = gather(values + offset, i), b = gather(values + offset + 1, i);
      return fma(tx, b - a, a);
    };
    const V near_low = pair(0), near_high = pair(row);
    const V far_low = pair(layer), far_high = pair(layer + row);
    const V near = fma(ty, near_high - near_low, near_low);
    const V far = fma(ty, far_high - far_low, far_low);
    const V inside = fma(tz, far - near, near);
    if (Lanes<V>::bits(beyond > 0.0f) == 0) return inside;
    const V outside = -(cell * sqrt(beyond + square(inside * per_cell)));
    return select(beyond > 0.0f, outside, inside);
  }

  /// The gradient by central differences over two cells.
  template <class V>
  PM_HD Points<V> gradient(const Points<V>& p) const {
    const auto slope = [&](float dx, float dy, float dz) {
      const Points<V> high = {p.x + dx, p.y + dy, p.z + dz}, low = {p.x - dx, p.y - dy, p.z - dz};
      return (at(high) - at(low)) * (0.5f * per_cell);
    };
    return {slope(cell, 0, 0), slope(0, cell, 0), slope(0, 0, cell)};
  }

 private:
  template <class V>
  PM_HD static V square(V a) {
    return a * a;
  }
  /// The cell along an axis, where in it (t), and what is added to the squared distance (in cells)
  /// from the grid.
  template <class V>
  PM_HD auto along(V p, float from, float last_point, V& t, V& beyond) const {
    const V u = (p - from) * per_cell;
    const V clamped = min(max(u, broadcast<V>(0.0f)), broadcast<V>(last_point));
    const V off = u - clamped;
    beyond = fma(off, off, beyond);
    const V below = min(max(round_to_nearest(clamped - 0.5f), broadcast<V>(0.0f)),
                        broadcast<V>(last_point - 1));
    t = clamped - below;
    return to_index(below);
  }
};

}  // namespace polymorph
