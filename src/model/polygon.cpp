#include "model/polygon.h"

#include <algorithm>
#include <cmath>

#include "base/result.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

struct Point2 {
  double x = 0, y = 0;
};

double turn(Point2 a, Point2 b, Point2 c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Newell's normal: exact for planar polygons, a mean one for others; concave corners do no harm.
Vec3d newell_normal(std::span<const Vec3> corners) {
  Vec3d sum;
  const Vec3d origin(corners[0]);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3d a = Vec3d(corners[i]) - origin;
    const Vec3d b = Vec3d(corners[(i + 1) % corners.size()]) - origin;
    sum = sum + cross(a, b);
  }
  return sum;
}

class EarClipper {
 public:
  EarClipper(std::vector<Point2> points, double slack) : points_(std::move(points)), slack_(slack) {
    const auto n = static_cast<std::uint32_t>(points_.size());
    next_.resize(n);
    previous_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      next_[i] = (i + 1) % n;
      previous_[i] = (i + n - 1) % n;
    }
  }

  bool run(std::vector<std::array<std::uint32_t, 3>>& triangles) {
    bool simple = true;
    std::vector<std::uint8_t> ear(points_.size());
    for (std::uint32_t i = 0; i < ear.size(); ++i) ear[i] = is_ear(i);
    std::uint32_t at = 1;
    for (std::size_t left = points_.size(); left > 3; --left) {
      std::uint32_t tried = 0;
      while (!ear[at] && tried++ < left) at = next_[at];
      if (!ear[at]) {
        // Corners that touched the outline may have blocked ears that are free by now.
        for (std::uint32_t k = 0; k < left; ++k, at = next_[at]) ear[at] = is_ear(at);
        for (std::uint32_t k = 0; k < left && !ear[at]; ++k) at = next_[at];
      }
      if (!ear[at]) {
        // No ear left: the outline crosses itself, or its corners lie in one line. Cut where it
        // bulges most.
        simple = simple && only_flat_left(at, left);
        at = most_convex(at, left);
      }
      const std::uint32_t before = previous_[at], after = next_[at];
      triangles.push_back({before, at, after});
      next_[before] = after;
      previous_[after] = before;
      ear[before] = is_ear(before);
      ear[after] = is_ear(after);
      // Going on behind the neighbour spreads the cuts and avoids long fans.
      at = next_[after];
    }
    triangles.push_back({previous_[at], at, next_[at]});
    return simple;
  }

 private:
  double turn_at(std::uint32_t i) const {
    return turn(points_[previous_[i]], points_[i], points_[next_[i]]);
  }
  bool is_ear(std::uint32_t i) const {
    if (turn_at(i) <= slack_) return false;
    const Point2 a = points_[previous_[i]], b = points_[i], c = points_[next_[i]];
    for (std::uint32_t k = next_[next_[i]]; k != previous_[i]; k = next_[k]) {
      const Point2 p = points_[k];
      // Bridges of polygons with holes visit a place twice: its twin does not block the ear.
      if ((p.x == a.x && p.y == a.y) || (p.x == b.x && p.y == b.y) || (p.x == c.x && p.y == c.y))
        continue;
      if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
    }
    return true;
  }
  bool only_flat_left(std::uint32_t at, std::size_t left) const {
    for (; left > 0; --left, at = next_[at])
      if (std::abs(turn_at(at)) > slack_) return false;
    return true;
  }
  std::uint32_t most_convex(std::uint32_t at, std::size_t left) const {
    std::uint32_t best = at;
    for (; left > 0; --left, at = next_[at])
      if (turn_at(at) > turn_at(best)) best = at;
    return best;
  }

  std::vector<Point2> points_;
  double slack_;
  std::vector<std::uint32_t> next_, previous_;
};

}  // namespace

PolygonTriangles triangulate(std::span<const Vec3> corners) {
  PM_CHECK(corners.size() >= 3);
  PolygonTriangles result;
  if (corners.size() == 3) {
    result.triangles = {{0, 1, 2}};
    return result;
  }
  const Vec3d normal = normalized(newell_normal(corners));
  const Vec3d side = std::abs(normal.x) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d u = normalized(cross(side, normal));
  const Vec3d v = cross(normal, u);
  std::vector<Point2> flat;
  double low = 0, high = 0, size2 = 0;
  for (const Vec3 corner : corners) {
    const Vec3d p = Vec3d(corner) - Vec3d(corners[0]);
    flat.push_back({dot(p, u), dot(p, v)});
    low = std::min(low, dot(p, normal));
    high = std::max(high, dot(p, normal));
    size2 = std::max(size2, dot(p, p));
  }
  result.planar = high - low <= 0.1 * std::sqrt(size2);
  const double slack = 1e-12 * size2;
  if (corners.size() == 4) {
    const bool by_02 =
        turn(flat[0], flat[1], flat[2]) > slack && turn(flat[0], flat[2], flat[3]) > slack;
    const bool by_13 =
        turn(flat[1], flat[2], flat[3]) > slack && turn(flat[1], flat[3], flat[0]) > slack;
    result.simple = by_02 || by_13;
    if (by_02 || !by_13)
      result.triangles = {{0, 1, 2}, {0, 2, 3}};
    else
      result.triangles = {{1, 2, 3}, {1, 3, 0}};
    return result;
  }
  result.simple = EarClipper(std::move(flat), slack).run(result.triangles);
  return result;
}

}  // namespace polymorph
