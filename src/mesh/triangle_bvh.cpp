#include "mesh/triangle_bvh.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "kernels/linear.h"

namespace polymorph {
namespace {

constexpr std::size_t kLeafTriangles = TriangleBvh::kLeafTriangles;

/// A piece of a triangle, which has a slot and a box of its own.
struct Piece {
  Box box;
  std::uint32_t triangle = 0;
};

/// Builds a hierarchy over items: the pieces of split triangles or, if there are none, the
/// triangles. Ranges are lists of item indices.
struct Builder {
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;
  std::vector<Vec3> centers;  ///< centre of each item
  /// Pieces of the triangles if these are split; else empty.
  std::vector<Piece> pieces;
  TriangleBvh bvh;

  Box box_of_range(std::span<const std::uint32_t> range) const {
    Box box;
    for (const std::uint32_t i : range) {
      if (!pieces.empty())
        box = unite(box, pieces[i].box);
      else
        for (const std::uint32_t v : triangles[i].v) box = extend(box, points[v]);
    }
    return box;
  }

  /// Partitions the range at the median of the axis along which its centres extend furthest.
  /// Returns the size of the first half.
  std::size_t halve(std::span<std::uint32_t> range) const {
    Box bounds;
    for (const std::uint32_t i : range) bounds = extend(bounds, centers[i]);
    const Vec3 size = bounds.size();
    const auto along = [&](std::uint32_t i) {
      const Vec3& c = centers[i];
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

  /// Adds a leaf, padded to kLeafTriangles slots; returns its first slot.
  std::uint32_t add_leaf(std::span<const std::uint32_t> range) {
    const auto first = static_cast<std::uint32_t>(bvh.triangles.size());
    for (const std::uint32_t i : range) {
      const std::uint32_t t = pieces.empty() ? i : pieces[i].triangle;
      const auto& v = triangles[t].v;
      bvh.corners.push_back({{points[v[0]], points[v[1]], points[v[2]]}});
      bvh.triangles.push_back(t);
    }
    bvh.corners.resize(first + kLeafTriangles);
    bvh.triangles.resize(first + kLeafTriangles, TriangleBvh::kNone);
    return first;
  }

  /// Adds a node and its subtree; returns the node's index.
  std::uint32_t add_node(std::span<std::uint32_t> range) {
    const std::size_t index = bvh.nodes.size();
    bvh.nodes.emplace_back();
    std::array<std::span<std::uint32_t>, TriangleBvh::kWidth> ranges{range};
    // Halve the ranges three times, in place and therefore from the last one. The second half of a
    // range that fits into a leaf is empty.
    for (std::size_t count = 1; count < ranges.size(); count *= 2)
      for (std::size_t i = count; i-- > 0;) {
        const std::span<std::uint32_t> subrange = ranges[i];
        const std::size_t half =
            subrange.size() > kLeafTriangles ? halve(subrange) : subrange.size();
        ranges[2 * i] = subrange.first(half);
        ranges[2 * i + 1] = subrange.subspan(half);
      }
    TriangleBvh::Node node;
    for (std::size_t k = 0; k < ranges.size(); ++k) {
      const Box box = box_of_range(ranges[k]);
      const float low[3] = {box.low.x, box.low.y, box.low.z};
      const float high[3] = {box.high.x, box.high.y, box.high.z};
      for (int axis = 0; axis < 3; ++axis) {
        node.low[axis][k] = low[axis];
        node.high[axis][k] = high[axis];
      }
      const bool is_leaf = ranges[k].size() <= kLeafTriangles;
      node.count[k] = is_leaf ? static_cast<std::uint32_t>(ranges[k].size()) : 0;
      node.child[k] = ranges[k].empty() ? TriangleBvh::kNone
                      : is_leaf         ? add_leaf(ranges[k])
                                        : add_node(ranges[k]);
    }
    bvh.nodes[index] = node;
    return static_cast<std::uint32_t>(index);
  }
};

using Polygon = std::vector<Vec3d>;

double coordinate(Vec3d p, int axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

/// Clips a convex polygon by a plane across an axis and keeps one side (Sutherland and Hodgman
/// 1974).
Polygon clip(const Polygon& polygon, int axis, double position, bool keep_above) {
  const double sign = keep_above ? 1 : -1;
  Polygon result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3d a = polygon[i], b = polygon[(i + 1) % polygon.size()];
    const double from = sign * (coordinate(a, axis) - position),
                 to = sign * (coordinate(b, axis) - position);
    if (from >= 0) result.push_back(a);
    if ((from > 0 && to < 0) || (from < 0 && to > 0))
      result.push_back(a + (b - a) * (from / (from - to)));
  }
  return result;
}

/// Splits a polygon until no side of a piece's box is longer than `max_size`, and appends the
/// pieces. `slack` widens the boxes to cover rounding.
void split(const Polygon& polygon, std::uint32_t triangle, double max_size, float slack,
           std::vector<Piece>& pieces) {
  if (polygon.empty()) return;
  Vec3d low = polygon[0], high = low;
  for (const Vec3d p : polygon) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const Vec3d size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  if (!(coordinate(size, axis) > max_size)) {
    const Vec3 margin{slack, slack, slack};
    pieces.push_back({{to_float(low) - margin, to_float(high) + margin}, triangle});
    return;
  }
  const double middle = coordinate(low + size * 0.5, axis);
  split(clip(polygon, axis, middle, /*keep_above=*/false), triangle, max_size, slack, pieces);
  split(clip(polygon, axis, middle, /*keep_above=*/true), triangle, max_size, slack, pieces);
}

/// Splits the triangles into pieces if many of them are long, or fewer whose boxes overlap heavily
/// (build_split_bvh()). Otherwise returns no pieces.
std::vector<Piece> split_long_triangles(std::span<const Vec3> points,
                                        std::span<const Triangle> triangles) {
  constexpr double kLong = 1.0 / 16, kPiece = 1.0 / 64;      // fractions of the diagonal
  constexpr std::size_t kSomeLong = 1024, kManyLong = 4096;  // numbers of long triangles
  constexpr double kCrowded = 16;  // mean number of long triangles' boxes that a point lies in
  constexpr double kMaxPieces = 1 << 19;  // in addition to one per triangle
  if (triangles.size() <= kSomeLong) return {};
  Box box;
  for (const Vec3 p : points) box = extend(box, p);
  const auto diagonal = static_cast<double>(box.diagonal());
  const auto volume = [&](const Box& b) {  // padded, so that flat boxes count too
    const Vec3d size = Vec3d(b.size()) + Vec3d(1, 1, 1) * (kPiece * diagonal);
    return size.x * size.y * size.z;
  };
  double volume_sum = 0;  // of the long triangles' boxes
  struct Size {           // of a long triangle
    double length, height;
  };
  std::vector<Size> sizes;
  for (const Triangle& t : triangles) {
    const Vec3d a(points[t.v[0]]), b(points[t.v[1]]), c(points[t.v[2]]);
    const double longest = std::max({length(b - a), length(c - b), length(a - c)});
    if (!(longest > kLong * diagonal)) continue;
    sizes.push_back({longest, length(cross(b - a, c - a)) / longest});
    Box bounds;
    for (const std::uint32_t v : t.v) bounds = extend(bounds, points[v]);
    volume_sum += volume(bounds);
  }
  const bool is_crowded = sizes.size() > kSomeLong && volume_sum > kCrowded * volume(box);
  if (sizes.size() <= kManyLong && !is_crowded) return {};
  // Upper bound of the number of pieces, in addition to one per triangle.
  const auto count_pieces = [&](double piece_size) {
    double sum = 0;
    for (const Size s : sizes) sum += (s.length / piece_size + 1) * (s.height / piece_size + 1) - 1;
    return sum;
  };
  double piece_size = kPiece * diagonal;
  while (count_pieces(piece_size) > kMaxPieces) piece_size *= 2;
  std::vector<Piece> pieces;
  const Vec3 max_coordinates = max(box.high, -box.low);
  const float slack =
      1e-6f *
      (box.diagonal() + std::max({max_coordinates.x, max_coordinates.y, max_coordinates.z, 0.0f}));
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto& v = triangles[t].v;
    split({Vec3d(points[v[0]]), Vec3d(points[v[1]]), Vec3d(points[v[2]])}, t, piece_size, slack,
          pieces);
  }
  return pieces;
}

}  // namespace

TriangleBvh build_split_bvh(std::span<const Vec3> points, std::span<const Triangle> triangles) {
  Builder builder{points, triangles, /*centers=*/{}, split_long_triangles(points, triangles),
                  /*bvh=*/{}};
  if (builder.pieces.empty()) return build_triangle_bvh(points, triangles);
  builder.bvh.is_split = true;
  for (const Piece& piece : builder.pieces) builder.centers.push_back(piece.box.center());
  std::vector<std::uint32_t> order(builder.pieces.size());
  std::iota(order.begin(), order.end(), 0u);
  builder.add_node(order);
  return std::move(builder.bvh);
}

TriangleBvh build_triangle_bvh(std::span<const Vec3> points, std::span<const Triangle> triangles) {
  Builder builder{points, triangles, /*centers=*/{}, /*pieces=*/{}, /*bvh=*/{}};
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
