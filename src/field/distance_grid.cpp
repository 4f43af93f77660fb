#include "field/distance_grid.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "base/array3.h"
#include "base/parallel.h"
#include "base/result.h"
#include "field/thin_parts.h"
#include "kernels/large_pages.h"
#include "kernels/simd_math.h"
#include "mesh/crossings.h"
#include "mesh/vertex_clustering.h"
#include "mesh/winding_slope.h"

namespace polymorph {
namespace {

constexpr int kCoarse = 4;  ///< fine cells per coarse cell, per axis
/// Distance from the surface, in fine cells: values are exact up to kExact and smooth from kFar on.
constexpr float kExact = 2, kFar = 4;

/// Makes the grid of every kCoarse-th point of make_distance_grid().
Grid make_coarse_grid(const Box& box, float cell) {
  const Vec3 size = box.size();
  const float longest = std::max({size.x, size.y, size.z});
  const float fine = std::max(cell, longest / kMaxDistanceCells);
  const float margin = std::max(0.06f * box.diagonal(), (kFar + 2 * kCoarse) * fine);
  const auto points = [&](float extent) {
    return static_cast<int>(std::ceil((extent + 2 * margin) / (kCoarse * fine))) + 1;
  };
  Grid coarse{/*origin=*/{}, kCoarse * fine, {points(size.x), points(size.y), points(size.z)}};
  const auto middle = [&](int count) { return 0.5f * static_cast<float>(count - 1) * coarse.cell; };
  coarse.origin = box.center() -
                  Vec3{middle(coarse.points.x), middle(coarse.points.y), middle(coarse.points.z)};
  return coarse;
}

/// Queries on a model, settings of its distances, and properties of the whole model.
struct Solid {
  const InsideTest& inside;
  const ClosestPointQuery& closest;
  std::span<const FaceClass> face_classes;
  float thinnest = 0;
  float cell = 0;  ///< edge of a fine cell
  OpenEdges open_edges = {};
  bool is_shell = false;  ///< all faces are sheets: nothing is inside
  /// True if a point's winding number may be concluded from a neighbour's where no face lies
  /// between them.
  bool may_conclude = false;
  bool counts_crossings = false;  ///< true if it may be where faces lie between
};

/// Tests whether no face lies between two adjacent points, `spacing` apart: the distance of either
/// from the surface exceeds the spacing (by 1 %, because of rounding).
bool has_no_face_between(float distance, float known_distance, float spacing) {
  return std::max(distance, known_distance) > 1.01f * spacing;
}

/// Tests whether points to which no face lies on the way from a point of the given winding number
/// are on the same side, where the number changes by at most `change` because of open edges. Both
/// numbers are approximate (InsideTest::winding_number).
bool decides_side(double winding_number, float change) {
  constexpr double kError = 0.08;
  return std::abs(winding_number - 0.5) > static_cast<double>(change) + 2 * kError;
}

/// Tests whether the closest face lies inside the solid, so that the boundary is further away: a
/// point just behind that face, seen from p, is then inside, too.
bool is_hidden(const Solid& solid, Vec3 p, const ClosestPoint& closest, bool point_is_inside) {
  const FaceClass face_class = solid.face_classes[closest.triangle];
  return point_is_inside && (face_class == FaceClass::kMixed || face_class == FaceClass::kHidden) &&
         solid.inside.inside(closest.point + normalized(closest.point - p) * (0.02f * solid.cell));
}

/// Increases the values of points whose closest face is hidden. The distance to the boundary is
/// 1-Lipschitz; the largest such function that agrees with the known values is, at each point, the
/// minimum over all known points of their value plus the distance from there.
void extend_to_hidden(const Grid& grid, const std::vector<std::uint8_t>& hidden,
                      std::vector<float>& values) {
  if (std::find(hidden.begin(), hidden.end(), 1) == hidden.end()) return;
  constexpr float kUnknown = 1e30f;
  for (std::size_t n = 0; n < values.size(); ++n)
    if (hidden[n]) values[n] = kUnknown;
  const Int3 size = grid.points;
  const auto sweep = [&](bool forward) {
    const std::int64_t count = std::int64_t{size.x} * size.y * size.z;
    for (std::int64_t k = 0; k < count; ++k) {
      const std::int64_t n = forward ? k : count - 1 - k;
      if (!hidden[static_cast<std::size_t>(n)]) continue;
      const Int3 at = array3_position(size, n);
      float min_value = values[static_cast<std::size_t>(n)];
      for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            const Int3 q{at.x + dx, at.y + dy, at.z + dz};
            if (q.x < 0 || q.y < 0 || q.z < 0 || q.x >= size.x || q.y >= size.y || q.z >= size.z)
              continue;
            const float step =
                grid.cell * std::sqrt(static_cast<float>(dx * dx + dy * dy + dz * dz));
            min_value = std::min(min_value, values[array3_index(size, q)] + step);
          }
      values[static_cast<std::size_t>(n)] = min_value;
    }
  };
  // A second round reaches points whose shortest path to a known point changes direction.
  for (int i = 0; i < 2; ++i) sweep(/*forward=*/true), sweep(/*forward=*/false);
  // Only if no value is known, some are still unknown here.
  for (std::size_t n = 0; n < values.size(); ++n)
    if (values[n] >= kUnknown) values[n] = 0;
}

/// Results of measure_coarse() besides the signed distances, one per coarse point.
struct CoarsePoints {
  std::vector<float> face_distances;   ///< distance of the closest face, hidden or not
  std::vector<float> winding_numbers;  ///< NaN: not computed but concluded from open edges
};

/// Measures signed distances at the coarse points, which are the coefficients of the spline.
std::vector<float> measure_coarse(const Solid& solid, const Grid& coarse, CoarsePoints& found) {
  std::vector<float> values(array3_count(coarse.points));
  std::vector<std::uint8_t> hidden(values.size(), 0);
  found.face_distances.resize(values.size());
  found.winding_numbers.resize(values.size());
  parallel_for(
      std::int64_t{coarse.points.y} * coarse.points.z,
      [&](std::int64_t line) {
        bool point_is_inside = false;
        double winding_number = 0;
        float change = 0;  // bounds the change of the winding number since it was computed
        ClosestPoint last;
        Vec3 last_point;
        for (int x = 0; x < coarse.points.x; ++x) {
          const std::int64_t n = line * coarse.points.x + x;
          const Vec3 p = grid_point(coarse, array3_position(coarse.points, n));
          const ClosestPoint closest =
              x == 0 ? solid.closest.closest(p) : solid.closest.closest(p, last_point, last);
          const bool follows = x > 0 && solid.may_conclude &&
                               has_no_face_between(closest.distance, last.distance, coarse.cell);
          if (follows)
            change += coarse.cell * max_winding_slope(solid.open_edges, (p + last_point) * 0.5f,
                                                      0.5f * coarse.cell);
          if (!solid.is_shell && !(follows && decides_side(winding_number, change))) {
            winding_number = solid.inside.winding_number(p);
            point_is_inside = winding_number >= 0.5;
            change = 0;
          }
          found.face_distances[static_cast<std::size_t>(n)] = closest.distance;
          found.winding_numbers[static_cast<std::size_t>(n)] =
              change == 0 ? static_cast<float>(winding_number)
                          : std::numeric_limits<float>::quiet_NaN();
          last = closest;
          last_point = p;
          values[static_cast<std::size_t>(n)] =
              point_is_inside ? closest.distance : -closest.distance;
          hidden[static_cast<std::size_t>(n)] = is_hidden(solid, p, closest, point_is_inside);
        }
      },
      /*grain=*/4);
  extend_to_hidden(coarse, hidden, values);
  return values;
}

/// Blends the exact distance into `value`, which holds the smooth distance. Sheets get a thickness.
void set_near(const Solid& solid, Vec3 p, const ClosestPoint& closest, bool point_is_inside,
              float& value) {
  if (is_hidden(solid, p, closest, point_is_inside)) return;
  float exact = point_is_inside ? closest.distance : -closest.distance;
  if (!point_is_inside && solid.face_classes[closest.triangle] == FaceClass::kSheet)
    exact = std::max(exact, kThickening * solid.thinnest - closest.distance);
  const float t =
      std::clamp((closest.distance / solid.cell - kExact) / (kFar - kExact), 0.0f, 1.0f);
  const float blend = t * t * (3 - 2 * t);
  value = exact + blend * (value - exact);
}

/// A block of kCoarse^3 points.
struct Block {
  Int3 first;                ///< its lowest point
  float winding_number = 0;  ///< winding number of that point; NaN: unknown
  /// Bounds the change of the winding number between any two of its points because of open edges.
  float change = 0;
};

/// A point of a block.
struct BlockPoint {
  Int3 at;
  Vec3 position;
  ClosestPoint closest;
  std::size_t neighbour = 0;  ///< index of an adjacent point that was measured before
  /// Winding number less the neighbour's, but for open edges; none: unknown.
  std::optional<int> entries;
  double winding_number = 0;
};

/// The triangles that touch a block's box, once they have been needed.
struct BlockTriangles {
  Box box;
  bool are_listed = false;
  std::vector<TriangleBvh::Corners> corners;
};

/// Computes BlockPoint::entries of b, whose neighbour along `axis` is a.
std::optional<int> find_entries(const Solid& solid, const BlockPoint& a, const BlockPoint& b,
                                int axis, BlockTriangles& triangles) {
  if (has_no_face_between(a.closest.distance, b.closest.distance, solid.cell)) return 0;
  if (!solid.counts_crossings) return std::nullopt;
  if (!triangles.are_listed) list_triangles(solid.closest.view(), triangles.box, triangles.corners);
  triangles.are_listed = true;
  const auto coordinate = [&](Vec3 p) {
    return static_cast<double>(axis == 0 ? p.x : axis == 1 ? p.y : p.z);
  };
  return count_entries(triangles.corners, a.position, axis,
                       coordinate(b.position) - coordinate(a.position));
}

/// Sets the values near the surface in one block.
void measure_block(const Solid& solid, const Block& block, float max_distance,
                   DistanceGrid& result) {
  constexpr std::size_t kPoints = kCoarse * kCoarse * kCoarse;
  BlockPoint points[kPoints];
  const Int3 first = block.first, n = result.grid.points;
  const Int3 end{std::min(first.x + kCoarse, n.x), std::min(first.y + kCoarse, n.y),
                 std::min(first.z + kCoarse, n.z)};
  const auto index = [](int x, int y, int z) {
    return static_cast<std::size_t>((z * kCoarse + y) * kCoarse + x);
  };
  BlockTriangles triangles;
  triangles.box = {grid_point(result.grid, first),
                   grid_point(result.grid, {end.x - 1, end.y - 1, end.z - 1})};
  const bool may_conclude =
      !solid.is_shell && solid.may_conclude && decides_side(/*winding_number=*/0, block.change);
  // Points whose winding number is computed first, together; the others follow in their order.
  std::size_t tested[kPoints], test_count = 0;
  Vec3 tested_positions[kPoints];
  for (int z = 0; z < end.z - first.z; ++z)
    for (int y = 0; y < end.y - first.y; ++y)
      for (int x = 0; x < end.x - first.x; ++x) {
        const std::size_t i = index(x, y, z);
        BlockPoint& point = points[i];
        point.at = {first.x + x, first.y + y, first.z + z};
        point.position = grid_point(result.grid, point.at);
        // The previous point along x; in the first column along y; in the first row along z. The
        // first point has none.
        const int axis = x > 0 ? 0 : y > 0 ? 1 : 2;
        point.neighbour = axis == 0   ? index(x - 1, y, z)
                          : axis == 1 ? index(x, y - 1, z)
                                      : index(x, y, std::max(z - 1, 0));
        const BlockPoint& neighbour = points[point.neighbour];
        if (i == 0) {
          point.closest = solid.closest.closest(point.position, max_distance);
          point.winding_number = static_cast<double>(block.winding_number);
          if (!std::isnan(block.winding_number)) continue;
        } else {
          point.closest = solid.closest.closest(point.position, neighbour.position,
                                                neighbour.closest, max_distance);
          if (may_conclude) point.entries = find_entries(solid, neighbour, point, axis, triangles);
          if (point.entries) continue;
        }
        tested[test_count] = i;
        tested_positions[test_count++] = point.position;
      }
  double numbers[kPoints] = {};
  if (!solid.is_shell) solid.inside.winding_numbers({tested_positions, test_count}, numbers);
  for (std::size_t k = 0; k < test_count; ++k) points[tested[k]].winding_number = numbers[k];
  for (int z = 0; z < end.z - first.z; ++z)
    for (int y = 0; y < end.y - first.y; ++y)
      for (int x = 0; x < end.x - first.x; ++x) {
        BlockPoint& point = points[index(x, y, z)];
        if (point.entries) {
          point.winding_number = points[point.neighbour].winding_number + *point.entries;
          if (!decides_side(point.winding_number, block.change))
            point.winding_number = solid.inside.winding_number(point.position);
        }
        if (point.closest.triangle != ClosestPoint::kNoTriangle)
          set_near(solid, point.position, point.closest,
                   !solid.is_shell && point.winding_number >= 0.5,
                   result.values[array3_index(n, point.at)]);
      }
}

/// Computes exact distances near the surface, in those of the `blocks` of kCoarse^3 points that may
/// have a point closer than kFar cells to it. `found` belongs to their lowest points.
void measure_near(const Solid& solid, Int3 blocks, const CoarsePoints& found,
                  DistanceGrid& result) {
  const float max_distance = kFar * solid.cell;
  const float half_diagonal = 0.5f * std::sqrt(3.0f) * (kCoarse - 1) * solid.cell;
  const float middle = 0.5f * (kCoarse - 1) * solid.cell;
  parallel_for(
      std::int64_t{blocks.x} * blocks.y * blocks.z,
      [&](std::int64_t b) {
        // The middle is half a diagonal away from the lowest point; 1 % is for rounding.
        if (found.face_distances[static_cast<std::size_t>(b)] >
            1.01f * (max_distance + 2 * half_diagonal))
          return;
        const Int3 block = array3_position(blocks, b);
        const Int3 first{block.x * kCoarse, block.y * kCoarse, block.z * kCoarse};
        const Vec3 center = grid_point(result.grid, first) + Vec3{middle, middle, middle};
        const ClosestPoint closest = solid.closest.closest(center, max_distance + half_diagonal);
        if (closest.triangle == ClosestPoint::kNoTriangle) return;
        const float change =
            2 * half_diagonal * max_winding_slope(solid.open_edges, center, half_diagonal);
        measure_block(solid, {first, found.winding_numbers[static_cast<std::size_t>(b)], change},
                      max_distance, result);
      },
      /*grain=*/4);
}

/// For each of as many consecutive cells along x as V has lanes, bounds the square of the length of
/// the trilinear distances' gradient times the edge of a cell. `low`: value at the lowest
/// corner of the first cell; `row`, `layer`: index steps along y and z.
template <class V>
V squared_slope(const float* low, std::size_t row, std::size_t layer) {
  V corners[8];  // bits 0, 1, 2 of the index are x, y, z
  for (std::size_t i = 0; i < 8; ++i)
    corners[i] = Lanes<V>::load(low + (i & 1) + (i >> 1 & 1) * row + (i >> 2) * layer);
  V slope2 = broadcast<V>(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    V steepest = broadcast<V>(0.0f);
    for (int i = 0; i < 8; ++i) {
      if (i >> axis & 1) continue;
      const V rise = corners[i | 1 << axis] - corners[i];
      steepest = max(steepest, max(rise, -rise));
    }
    slope2 += steepest * steepest;
  }
  return slope2;
}

}  // namespace

Grid make_distance_grid(const Box& box, float cell) {
  const Grid coarse = make_coarse_grid(box, cell);
  const Int3 n = coarse.points;
  return {coarse.origin,
          coarse.cell / kCoarse,
          {kCoarse * (n.x - 1) + 1, kCoarse * (n.y - 1) + 1, kCoarse * (n.z - 1) + 1}};
}

void evaluate_spline_layers(const SmoothDistances& smooth, const Grid& fine, int begin, int end,
                            float* values) {
  const Int3 n = fine.points, nodes = smooth.grid.points;
  // The three coefficients that contribute to a point, along one axis, and their weights.
  struct Axis {
    int at[3];  // indices, clamped to the coarse grid
    float weight[3];
  };
  const auto axis_at = [](int point, int count) {
    Axis axis;
    const float u = static_cast<float>(point) / kCoarse;
    const float middle = std::floor(u + 0.5f), f = u - middle;
    axis.weight[0] = 0.5f * (0.5f - f) * (0.5f - f);
    axis.weight[2] = 0.5f * (0.5f + f) * (0.5f + f);
    axis.weight[1] = 1 - axis.weight[0] - axis.weight[2];
    for (int i = 0; i < 3; ++i)
      axis.at[i] = std::clamp(static_cast<int>(middle) - 1 + i, 0, count - 1);
    return axis;
  };
  // Eight points side by side along x. Their coefficients lie within eight that follow each other.
  struct AxisPack {
    std::size_t first;  ///< lowest index of a coefficient
    PackBits at[3];     ///< indices relative to `first`
    Pack weight[3];
  };
  constexpr int kCount = Lanes<Pack>::kCount;
  std::vector<AxisPack> along_x;
  for (int x = 0; x < n.x; x += kCount) {
    AxisPack pack;
    const int first = axis_at(x, nodes.x).at[0];
    pack.first = static_cast<std::size_t>(first);
    for (int l = 0; l < kCount; ++l) {
      const Axis axis = axis_at(x + l, nodes.x);
      for (int i = 0; i < 3; ++i) {
        pack.at[i][l] = static_cast<std::uint32_t>(axis.at[i] - first);
        pack.weight[i][l] = axis.weight[i];
      }
    }
    along_x.push_back(pack);
  }
  // The last packs reach beyond the line.
  const auto node_count = static_cast<std::size_t>(nodes.x);
  std::vector<float> line(node_count + kCount), out(along_x.size() * kCount);
  for (int z = begin; z < end; ++z) {
    const Axis az = axis_at(z, nodes.z);
    for (int y = 0; y < n.y; ++y) {
      const Axis ay = axis_at(y, nodes.y);
      std::fill(line.begin(), line.end(), 0.0f);
      for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j) {
          const float weight = az.weight[k] * ay.weight[j];
          const float* from = smooth.values.data() + array3_index(nodes, 0, ay.at[j], az.at[k]);
          for (std::size_t x = 0; x < node_count; ++x) line[x] += weight * from[x];
        }
      for (std::size_t k = 0; k < along_x.size(); ++k) {
        const AxisPack& pack = along_x[k];
        const Pack coefficients = Lanes<Pack>::load(&line[pack.first]);
        Pack sum{};
        for (int i = 0; i < 3; ++i) sum += pack.weight[i] * permute(coefficients, pack.at[i]);
        Lanes<Pack>::store(&out[k * kCount], sum);
      }
      std::copy_n(out.begin(), n.x, values + array3_index(n, 0, y, z - begin));
    }
  }
}

std::vector<float> evaluate_spline(const SmoothDistances& smooth, const Grid& fine) {
  const Int3 n = fine.points;
  auto values = make_large_vector<float>(array3_count(n));
  parallel_ranges(n.z, /*grain=*/1, [&](std::int64_t begin, std::int64_t end) {
    const int first = static_cast<int>(begin);
    evaluate_spline_layers(smooth, fine, first, static_cast<int>(end),
                           values.data() + array3_index(n, 0, 0, first));
  });
  return values;
}

void close_border(const Grid& grid, int z, float* layer) {
  const Int3 n = grid.points;
  for (int y = 0; y < n.y; ++y) {
    const bool all = y == 0 || z == 0 || y == n.y - 1 || z == n.z - 1;
    float* const line = layer + array3_index(n, 0, y, 0);
    for (int x = 0; x < n.x; x += all ? 1 : n.x - 1) line[x] = std::min(line[x], -grid.cell);
  }
}

void close_border(DistanceGrid& distances) {
  const Int3 n = distances.grid.points;
  for (int z = 0; z < n.z; ++z)
    close_border(distances.grid, z, distances.values.data() + array3_index(n, 0, 0, z));
}

void set_lipschitz(DistanceGrid& distances) {
  const Int3 n = distances.grid.points;
  const auto row = static_cast<std::size_t>(n.x), layer_size = row * static_cast<std::size_t>(n.y);
  std::vector<float> layer_max(static_cast<std::size_t>(n.z - 1), 0.0f);
  parallel_for(n.z - 1, [&](std::int64_t z) {
    constexpr int kCount = Lanes<Pack>::kCount;
    Pack largest = {};
    float layer_largest = 0;  // at first of the cells that fill no pack
    for (int y = 0; y + 1 < n.y; ++y) {
      const float* low = distances.values.data() + array3_index(n, 0, y, static_cast<int>(z));
      int x = 0;
      for (; x + kCount < n.x; x += kCount)
        largest = max(largest, squared_slope<Pack>(low + x, row, layer_size));
      for (; x + 1 < n.x; ++x)
        layer_largest = max(layer_largest, squared_slope<float>(low + x, row, layer_size));
    }
    for (int i = 0; i < kCount; ++i) layer_largest = max(layer_largest, largest[i]);
    layer_max[static_cast<std::size_t>(z)] = layer_largest;
  });
  const float slope2 = *std::max_element(layer_max.begin(), layer_max.end());
  distances.lipschitz = std::max(1.0f, std::sqrt(slope2) / distances.grid.cell);
}

DistanceGrid compute_signed_distances(const QueriedModel& queried, float cell, float thinnest,
                                      SmoothDistances* smooth) {
  const auto& [model, inside, closest, face_classes, box] = queried;
  PM_CHECK(cell > 0 && !model.triangles.empty() && face_classes.size() == model.triangles.size());
  const Grid coarse = make_coarse_grid(box, cell);
  DistanceGrid result;
  result.grid = make_distance_grid(box, cell);
  Solid solid{inside, closest, face_classes, thinnest, result.grid.cell};
  solid.is_shell = std::all_of(face_classes.begin(), face_classes.end(),
                               [](FaceClass c) { return c == FaceClass::kSheet; });
  const MeshView mesh(model.points, model.triangles);
  solid.open_edges = find_open_edges(mesh);
  // Sums over many open edges take longer than winding numbers. Those of many long triangles are
  // not quite the model's (cluster_long_triangles()).
  constexpr std::size_t kMaxOpenEdges = 2048;
  const std::size_t open_count = solid.open_edges.count;
  const bool is_usual =
      !closest.view().is_split && !has_many_long_triangles(count_long_triangles(mesh));
  solid.may_conclude = open_count == 0 || (open_count <= kMaxOpenEdges && is_usual);
  solid.counts_crossings = solid.may_conclude && is_usual;
  if (!solid.may_conclude) solid.open_edges = {};
  CoarsePoints found;
  SmoothDistances spline{coarse, measure_coarse(solid, coarse, found)};
  result.values = evaluate_spline(spline, result.grid);
  measure_near(solid, coarse.points, found, result);
  if (thinnest > 0) smooth_thin_parts(model, thinnest, result);
  close_border(result);
  set_lipschitz(result);
  if (smooth) *smooth = std::move(spline);
  return result;
}

}  // namespace polymorph
