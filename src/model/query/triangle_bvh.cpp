#include "model/query/triangle_bvh.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace polymorph {
namespace {

constexpr std::size_t kLeafTriangles = TriangleBvh::kLeafTriangles;

struct Builder {
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;
  std::vector<Vec3> centers;
  TriangleBvh bvh;

  Box box_of_range(std::span<const std::uint32_t> range) const {
    Box box;
    for (const std::uint32_t t : range)
      for (const std::uint32_t v : triangles[t].v) box = extend(box, points[v]);
    return box;
  }

  /// Halves the range at the median of the axis along which its centres spread furthest.
  std::size_t halve(std::span<std::uint32_t> range) const {
    Box spread;
    for (const std::uint32_t t : range) spread = extend(spread, centers[t]);
    const Vec3 size = spread.size();
    const auto along = [&](std::uint32_t t) {
      const Vec3& c = centers[t];
      return size.x >= size.y && size.x >= size.z ? c.x : size.y >= size.z ? c.y : c.z;
    };
    const std::size_t half = range.size() / 2;
    std::nth_element(range.begin(), range.begin() + static_cast<std::ptrdiff_t>(half), range.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       const float x = along(a), y = along(b);
                       return x != y ? x < y : a < b;
                     });
    return half;
  }

  std::uint32_t add_leaf(std::span<const std::uint32_t> range) {
    const auto first = static_cast<std::uint32_t>(bvh.triangles.size());
    for (const std::uint32_t t : range) {
      const auto& v = triangles[t].v;
      bvh.corners.push_back({{points[v[0]], points[v[1]], points[v[2]]}});
      bvh.triangles.push_back(t);
    }
    bvh.corners.resize(first + kLeafTriangles);
    bvh.triangles.resize(first + kLeafTriangles, TriangleBvh::kNone);
    return first;
  }

  std::uint32_t add_node(std::span<std::uint32_t> range) {
    const std::size_t self = bvh.nodes.size();
    bvh.nodes.emplace_back();
    std::array<std::span<std::uint32_t>, TriangleBvh::kWidth> parts{range};
    for (std::size_t count = 1; count < parts.size(); count *= 2)
      for (std::size_t i = count; i-- > 0;) {
        const std::span<std::uint32_t> part = parts[i];
        const std::size_t half = part.size() > kLeafTriangles ? halve(part) : part.size();
        parts[2 * i] = part.first(half);
        parts[2 * i + 1] = part.subspan(half);
      }
    TriangleBvh::Node node;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const Box box = box_of_range(parts[k]);
      const float low[3] = {box.low.x, box.low.y, box.low.z};
      const float high[3] = {box.high.x, box.high.y, box.high.z};
      for (int axis = 0; axis < 3; ++axis) {
        node.low[axis][k] = low[axis];
        node.high[axis][k] = high[axis];
      }
      const bool leaf = parts[k].size() <= kLeafTriangles;
      node.count[k] = leaf ? static_cast<std::uint32_t>(parts[k].size()) : 0;
      node.child[k] = parts[k].empty() ? TriangleBvh::kNone
                      : leaf           ? add_leaf(parts[k])
                                       : add_node(parts[k]);
    }
    bvh.nodes[self] = node;
    return static_cast<std::uint32_t>(self);
  }
};

}  // namespace

TriangleBvh build_triangle_bvh(std::span<const Vec3> points, std::span<const Triangle> triangles) {
  Builder builder{points, triangles, {}, {}};
  if (triangles.empty()) return {};
  builder.centers.reserve(triangles.size());
  for (const Triangle& t : triangles)
    builder.centers.push_back(points[t.v[0]] / 3 + points[t.v[1]] / 3 + points[t.v[2]] / 3);
  std::vector<std::uint32_t> order(triangles.size());
  std::iota(order.begin(), order.end(), 0u);
  builder.add_node(order);
  return std::move(builder.bvh);
}

}  // namespace polymorph
