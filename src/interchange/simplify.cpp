#include "interchange/simplify.h"

#include <meshoptimizer.h>

#include <algorithm>

#include "base/box.h"
#include "interchange/split_surface.h"
#include "mesh/closest.h"

namespace polymorph {
namespace {

/// Collapses edges and returns the remaining triangles, which index vertices of the split surface.
/// `error` is the limit of meshoptimizer's error, relative to the surface's extent. Triangles with
/// `is_fixed` do not change. The others are simplified without them, so the points that they share
/// with fixed triangles lie on a border, and borders stay.
std::vector<Triangle> collapse_edges(const SurfaceFrame& frame, const SplitSurface& split,
                                     float error, const std::vector<std::uint8_t>& is_fixed) {
  std::vector<Vec3> positions;
  for (const std::uint32_t p : split.position_of) positions.push_back(frame.positions[p]);
  std::vector<Triangle> candidates, fixed_triangles;
  for (std::size_t t = 0; t < split.triangles.size(); ++t)
    (is_fixed[t] ? fixed_triangles : candidates).push_back(split.triangles[t]);
  if (candidates.empty()) return fixed_triangles;
  std::vector<Triangle> remaining(candidates.size());
  const std::size_t indices = meshopt_simplify(
      remaining.front().v, candidates.front().v, 3 * candidates.size(), &positions.front().x,
      positions.size(), sizeof(Vec3), /*target_index_count=*/0, error, meshopt_SimplifyLockBorder,
      /*result_error=*/nullptr);
  remaining.resize(indices / 3);
  remaining.insert(remaining.end(), fixed_triangles.begin(), fixed_triangles.end());
  return remaining;
}

/// Converts triangles of the split surface to indices of positions.
std::vector<Triangle> to_positions(const SplitSurface& split,
                                   const std::vector<Triangle>& remaining) {
  std::vector<Triangle> triangles;
  for (const Triangle& t : remaining)
    triangles.push_back(
        {{split.position_of[t.v[0]], split.position_of[t.v[1]], split.position_of[t.v[2]]}});
  return triangles;
}

/// Lists the centroids of triangles and the midpoints of their edges.
std::vector<Vec3> list_midpoints(const SurfaceFrame& frame,
                                 const std::vector<Triangle>& triangles) {
  std::vector<Vec3> points;
  for (const Triangle& t : triangles) {
    const Vec3 a = frame.positions[t.v[0]], b = frame.positions[t.v[1]],
               c = frame.positions[t.v[2]];
    points.insert(points.end(), {(a + b + c) / 3, (a + b) / 2, (b + c) / 2, (c + a) / 2});
  }
  return points;
}

/// Measures the Hausdorff distance between the frame's surface, whose query is `original`, and the
/// triangles `remaining`. It is the larger of two one-sided distances: from the frame's points to
/// `remaining`, and from the midpoints of `remaining` to the frame's surface. Where a
/// distance exceeds `limit`, sets `is_fixed` of the frame's triangles around that place.
float measure_distance(const SurfaceFrame& frame, const ClosestPointQuery& original,
                       const std::vector<Triangle>& remaining, float limit,
                       std::vector<std::uint8_t>& is_fixed) {
  const ClosestPointQuery simplified(frame.positions, remaining);
  float farthest = 0;
  std::vector<std::uint8_t> exceeds(frame.positions.size(),
                                    0);  // 1: a distance at the point exceeds `limit`
  const std::vector<ClosestPoint> nearest = simplified.closest(frame.positions);
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    farthest = std::max(farthest, nearest[i].distance);
    if (nearest[i].distance > limit) exceeds[i] = 1;
  }
  for (const ClosestPoint& hit : original.closest(list_midpoints(frame, remaining))) {
    farthest = std::max(farthest, hit.distance);
    if (hit.distance > limit)
      for (const std::uint32_t v : frame.triangles[hit.triangle].v) exceeds[v] = 1;
  }
  if (farthest <= limit) return farthest;
  for (std::size_t t = 0; t < frame.triangles.size(); ++t) {
    const auto& v = frame.triangles[t].v;
    if (exceeds[v[0]] || exceeds[v[1]] || exceeds[v[2]]) is_fixed[t] = 1;
  }
  return farthest;
}

/// Reduces the frame to the vertices that the triangles `remaining` use.
void reduce_to(const SplitSurface& split, const std::vector<Triangle>& remaining,
               SurfaceFrame& frame) {
  SurfaceFrame result;
  result.is_model = frame.is_model;
  result.is_mixed = frame.is_mixed;
  result.mixture = frame.mixture;
  result.materials = frame.materials;
  // Each position's index in the result; 0xffffffff: not used so far.
  std::vector<std::uint32_t> new_index(frame.positions.size(), 0xffffffffu);
  const auto append_value = [](const auto& from, std::size_t i, auto& to) {
    if (!from.empty()) to.push_back(from[i]);
  };
  for (const Triangle& t : remaining) {
    Triangle& triangle = result.triangles.emplace_back();
    append_value(frame.triangle_materials, split.corner_of[t.v[0]] / 3, result.triangle_materials);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t p = split.position_of[t.v[k]];
      if (new_index[p] == 0xffffffffu) {
        new_index[p] = static_cast<std::uint32_t>(result.positions.size());
        append_value(frame.positions, p, result.positions);
        append_value(frame.normals, p, result.normals);
        append_value(frame.velocities, p, result.velocities);
        append_value(frame.colors, p, result.colors);
        append_value(frame.labels, p, result.labels);
      }
      triangle.v[k] = new_index[p];
      append_value(frame.corner_uvs, split.corner_of[t.v[k]], result.corner_uvs);
      append_value(frame.corner_normals, split.corner_of[t.v[k]], result.corner_normals);
    }
  }
  frame = std::move(result);
}

}  // namespace

float simplify(SurfaceFrame& frame, float distance) {
  constexpr int kMaxAttempts = 12;
  if (frame.triangles.empty()) return 0;
  const float extent = [&] {
    const Vec3 size = bounding_box(frame.positions).size();
    return std::max({size.x, size.y, size.z});
  }();
  if (!(extent > 0)) return 0;  // all points coincide
  const SplitSurface split = split_corners(frame, {/*uvs=*/true, /*materials=*/true});
  const ClosestPointQuery original(frame.positions, frame.triangles);
  std::vector<std::uint8_t> is_fixed(frame.triangles.size(), 0);
  // meshoptimizer bounds a mean distance from planes, not the Hausdorff distance. Regions where the
  // latter is too large are fixed, and the simplification is repeated with a smaller error.
  float error = 0.5f * distance / extent;
  for (int i = 0; i < kMaxAttempts; ++i) {
    const std::vector<Triangle> remaining = collapse_edges(frame, split, error, is_fixed);
    const float hausdorff =
        measure_distance(frame, original, to_positions(split, remaining), distance, is_fixed);
    if (hausdorff <= distance) {
      reduce_to(split, remaining, frame);
      return hausdorff;
    }
    error *= 0.95f;
  }
  return 0;  // no attempt kept the distance, so the frame stays as it is
}

}  // namespace polymorph
