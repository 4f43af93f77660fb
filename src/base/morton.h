// Morton order (Z-order curve) of points in a box.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/box.h"

namespace polymorph {

/// Inserts two zeros after each of the 21 bits of x.
constexpr std::uint64_t interleave_zeros(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

/// Index of a point on the Morton curve in a cube. The cube has the box's low corner, is as wide as
/// the box's diagonal, and has 2^21 cells per axis.
inline std::uint64_t morton_key(Vec3 p, const Box& box) {
  // 2097151 = 2^21 - 1, the largest coordinate; 1e-30 avoids a division by 0.
  const double scale = 2097151 / std::max(1e-30, static_cast<double>(box.diagonal()));
  const auto cell = [&](float x, float low) {
    return static_cast<std::uint64_t>(
        std::clamp((static_cast<double>(x) - low) * scale, 0.0, 2097151.0));
  };
  return interleave_zeros(cell(p.x, box.low.x)) | interleave_zeros(cell(p.y, box.low.y)) << 1 |
         interleave_zeros(cell(p.z, box.low.z)) << 2;
}

/// Sorts points by their Morton keys in the box, equal ones by index. Returns their indices.
inline std::vector<std::uint32_t> sort_by_morton_key(std::span<const Vec3> points, const Box& box) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  keys.reserve(points.size());
  for (const Vec3 p : points)
    keys.emplace_back(morton_key(p, box), static_cast<std::uint32_t>(keys.size()));
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order;
  order.reserve(keys.size());
  for (const auto& [key, index] : keys) order.push_back(index);
  return order;
}

}  // namespace polymorph
