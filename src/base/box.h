// Axis-aligned boxes.
#pragma once

#include <limits>
#include <span>

#include "kernels/types.h"

namespace polymorph {

/// The box from corner `low` to corner `high`. It is empty by default; center() of an empty box is
/// not a number.
struct Box {
  Vec3 low{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
           std::numeric_limits<float>::infinity()};
  Vec3 high{-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
            -std::numeric_limits<float>::infinity()};

  bool empty() const { return !(low.x <= high.x && low.y <= high.y && low.z <= high.z); }
  Vec3 size() const { return empty() ? Vec3{} : high - low; }
  PM_HD Vec3 center() const { return (low + high) * 0.5f; }
  float diagonal() const { return length(size()); }
};

/// Returns the smallest box that contains `box` and `p`, and that which contains both boxes.
PM_HD inline Box extend(Box box, Vec3 p) { return {min(box.low, p), max(box.high, p)}; }
PM_HD inline Box unite(Box a, Box b) { return {min(a.low, b.low), max(a.high, b.high)}; }
/// Returns the box with all faces moved outward by `margin`.
PM_HD inline Box widened(Box box, float margin) {
  const Vec3 offset{margin, margin, margin};
  return {box.low - offset, box.high + offset};
}
inline Box bounding_box(std::span<const Vec3> points) {
  Box box;
  for (Vec3 p : points) box = extend(box, p);
  return box;
}

}  // namespace polymorph
