#include "mesh/polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/result.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

struct Point2 {
  double x = 0, y = 0;
  bool operator==(const Point2&) const = default;
};

/// Twice the signed area of triangle abc: positive if it is counter-clockwise.
double signed_area(Point2 a, Point2 b, Point2 c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Newell's normal: exact for planar polygons, concave ones included; a mean normal for others.
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

/// A k-d tree of the corners not yet clipped, to find whether a triangle contains one without
/// testing all of them.
class CornerTree {
 public:
  explicit CornerTree(const std::vector<Point2>& points) : points_(points) {
    order_.resize(points.size());
    std::iota(order_.begin(), order_.end(), 0u);
    build(0, order_.size());
    rank_.resize(points.size());
    for (std::uint32_t i = 0; i < order_.size(); ++i) rank_[order_[i]] = i;
  }

  void remove(std::uint32_t corner) {
    const std::uint32_t rank = rank_[corner];
    for (std::uint32_t index = 0;;) {
      Node& node = nodes_[index];
      --node.remaining;
      if (node.second == 0) break;
      index = rank < nodes_[node.second].begin ? index + 1 : node.second;
    }
    removed_[rank] = 1;
  }

  /// Tests whether the triangle a, b, c contains a corner, also on its outline, but not at the
  /// positions of a, b and c: bridges of polygons with holes visit a point twice, and the second
  /// visit does not block an ear. Adds the number of steps to `work`.
  bool contains_corner(Point2 a, Point2 b, Point2 c, std::size_t& work) const {
    std::array<std::uint32_t, 64> stack;  // twice the depth that 2^32 corners need
    std::size_t stack_size = 0;
    stack[stack_size++] = 0;
    while (stack_size > 0) {
      const std::uint32_t index = stack[--stack_size];
      const Node& node = nodes_[index];
      ++work;
      if (node.remaining == 0 || is_to_the_right(a, b, node) || is_to_the_right(b, c, node) ||
          is_to_the_right(c, a, node))
        continue;
      if (node.second != 0) {
        stack[stack_size++] = node.second;
        stack[stack_size++] = index + 1;
        continue;
      }
      for (std::uint32_t i = node.begin; i < node.end; ++i) {
        ++work;
        if (removed_[i]) continue;
        const Point2 p = points_[order_[i]];
        if (p == a || p == b || p == c) continue;
        if (signed_area(a, b, p) >= 0 && signed_area(b, c, p) >= 0 && signed_area(c, a, p) >= 0)
          return true;
      }
    }
    return false;
  }

 private:
  struct Node {
    Point2 low, high;
    std::uint32_t begin = 0, end = 0;  ///< range of order_
    std::uint32_t remaining = 0;       ///< corners not yet removed
    std::uint32_t second = 0;  ///< second child (the first one follows the node); 0 = a leaf
  };

  /// Tests whether the whole box lies to the right of the line from a to b. It evaluates
  /// signed_area() at the box corner furthest to the left, so rounding cannot make it disagree with
  /// signed_area() of a point within.
  static bool is_to_the_right(Point2 a, Point2 b, const Node& node) {
    return signed_area(
               a, b, {b.y > a.y ? node.low.x : node.high.x, b.x > a.x ? node.high.y : node.low.y}) <
           0;
  }

  void build(std::size_t begin, std::size_t end) {
    constexpr std::size_t kMaxLeafCorners = 8;
    Node node;
    node.begin = static_cast<std::uint32_t>(begin);
    node.end = static_cast<std::uint32_t>(end);
    node.remaining = node.end - node.begin;
    node.low = node.high = points_[order_[begin]];
    for (std::size_t i = begin; i < end; ++i) {
      const Point2 p = points_[order_[i]];
      node.low = {std::min(node.low.x, p.x), std::min(node.low.y, p.y)};
      node.high = {std::max(node.high.x, p.x), std::max(node.high.y, p.y)};
    }
    const std::size_t index = nodes_.size();
    nodes_.push_back(node);
    if (end - begin <= kMaxLeafCorners) return;
    const bool is_wide = node.high.x - node.low.x > node.high.y - node.low.y;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t i, std::uint32_t j) {
      const double x = is_wide ? points_[i].x : points_[i].y;
      const double y = is_wide ? points_[j].x : points_[j].y;
      return x != y ? x < y : i < j;
    });
    build(begin, middle);
    nodes_[index].second = static_cast<std::uint32_t>(nodes_.size());
    build(middle, end);
  }

  const std::vector<Point2>& points_;
  std::vector<std::uint32_t> order_, rank_;  ///< corners in the order of leaves; its inverse
  std::vector<std::uint8_t> removed_ = std::vector<std::uint8_t>(points_.size(), 0);
  std::vector<Node> nodes_;
};

/// Clips the ears of a polygon in the plane one by one. Signed areas up to `slack` count as 0.
class EarClipper {
 public:
  EarClipper(std::vector<Point2> points, double slack)
      : points_(std::move(points)), slack_(slack), corners_(points_) {
    const auto n = static_cast<std::uint32_t>(points_.size());
    next_.resize(n);
    previous_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      next_[i] = (i + 1) % n;
      previous_[i] = (i + n - 1) % n;
    }
  }

  /// Appends the triangles; returns false if the outline crosses itself.
  bool clip(std::vector<std::array<std::uint32_t, 3>>& triangles) {
    // Simple outlines stay far below this limit of steps. Without it, outlines that cross
    // themselves everywhere would need more steps than the square of the number of corners.
    constexpr std::size_t kMinSteps = 4096;
    std::size_t work_limit = kMinSteps + 2048 * points_.size();
    bool simple = true;
    std::vector<std::uint8_t> ears(points_.size());  // per corner: 1 if it was an ear when tested
    for (std::uint32_t i = 0; i < ears.size(); ++i) ears[i] = is_ear(i);
    std::uint32_t corner = 1;
    for (std::size_t remaining = points_.size(); remaining > 3; --remaining) {
      if (work_ < work_limit) {
        corner = find_next_ear(corner, remaining, ears);
        if (!ears[corner]) {
          // No ear is left: the outline crosses itself, or its corners are collinear. Clip the
          // most convex corner. After the first crossing, a smaller limit applies.
          if (simple && !all_collinear(corner, remaining)) {
            simple = false;
            work_limit = std::min(work_limit, work_ + kMinSteps + 64 * points_.size());
          }
          corner = find_most_convex(corner, remaining);
        }
      } else {
        simple = false;  // the limit is reached: clip the corner, whatever it is
      }
      const std::uint32_t before = previous_[corner], after = next_[corner];
      triangles.push_back({before, corner, after});
      next_[before] = after;
      previous_[after] = before;
      corners_.remove(corner);
      if (work_ < work_limit) {
        ears[before] = is_ear(before);
        ears[after] = is_ear(after);
      }
      // Skipping a corner distributes the clipped ears and avoids long fans.
      corner = next_[after];
    }
    triangles.push_back({previous_[corner], corner, next_[corner]});
    return simple;
  }

 private:
  double signed_area_at(std::uint32_t i) const {
    return signed_area(points_[previous_[i]], points_[i], points_[next_[i]]);
  }
  bool is_ear(std::uint32_t i) {
    ++work_;
    return signed_area_at(i) > slack_ &&
           !corners_.contains_corner(points_[previous_[i]], points_[i], points_[next_[i]], work_);
  }
  /// Finds the next ear from `corner` on; returns any corner if there is none. `remaining`, here
  /// and below: number of corners not yet clipped.
  std::uint32_t find_next_ear(std::uint32_t corner, std::size_t remaining,
                              std::vector<std::uint8_t>& ears) {
    for (std::size_t k = 0; k < remaining && !ears[corner]; ++k, ++work_) corner = next_[corner];
    if (ears[corner]) return corner;
    // Corners that touched the outline and blocked an ear may have been clipped since.
    for (std::size_t k = 0; k < remaining; ++k, corner = next_[corner])
      ears[corner] = is_ear(corner);
    for (std::size_t k = 0; k < remaining && !ears[corner]; ++k) corner = next_[corner];
    return corner;
  }
  bool all_collinear(std::uint32_t corner, std::size_t remaining) {
    work_ += remaining;
    for (; remaining > 0; --remaining, corner = next_[corner])
      if (std::abs(signed_area_at(corner)) > slack_) return false;
    return true;
  }
  std::uint32_t find_most_convex(std::uint32_t corner, std::size_t remaining) {
    work_ += remaining;
    std::uint32_t best = corner;
    for (; remaining > 0; --remaining, corner = next_[corner])
      if (signed_area_at(corner) > signed_area_at(best)) best = corner;
    return best;
  }

  std::vector<Point2> points_;
  double slack_;
  CornerTree corners_;
  std::vector<std::uint32_t> next_, previous_;
  std::size_t work_ = 0;  ///< steps so far
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
  const Vec3d helper_axis = std::abs(normal.x) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d u = normalized(cross(helper_axis, normal));
  const Vec3d v = cross(normal, u);
  std::vector<Point2> projected;
  double low = 0, high = 0, size2 = 0;
  for (const Vec3 corner : corners) {
    const Vec3d p = Vec3d(corner) - Vec3d(corners[0]);
    projected.push_back({dot(p, u), dot(p, v)});
    low = std::min(low, dot(p, normal));
    high = std::max(high, dot(p, normal));
    size2 = std::max(size2, dot(p, p));
  }
  result.planar = high - low <= 0.1 * std::sqrt(size2);
  const double slack = 1e-12 * size2;
  if (corners.size() == 4) {
    const bool is_diagonal_02_valid =
        signed_area(projected[0], projected[1], projected[2]) > slack &&
        signed_area(projected[0], projected[2], projected[3]) > slack;
    const bool is_diagonal_13_valid =
        signed_area(projected[1], projected[2], projected[3]) > slack &&
        signed_area(projected[1], projected[3], projected[0]) > slack;
    result.simple = is_diagonal_02_valid || is_diagonal_13_valid;
    if (is_diagonal_02_valid || !is_diagonal_13_valid)
      result.triangles = {{0, 1, 2}, {0, 2, 3}};
    else
      result.triangles = {{1, 2, 3}, {1, 3, 0}};
    return result;
  }
  result.simple = EarClipper(std::move(projected), slack).clip(result.triangles);
  return result;
}

}  // namespace polymorph
