#include "interchange/simplify.h"

#include <meshoptimizer.h>

#include <algorithm>

#include "base/box.h"
#include "interchange/split_surface.h"
#include "mesh/closest.h"

namespace polymorph {
namespace {

/// The triangles that are left, as vertices of the split surface. Those of `fixed` stay as they
/// are, and so do the points that they share with others.
std::vector<Triangle> collapsed(const SurfaceFrame& frame, const SplitSurface& split, float error,
                                const std::vector<std::uint8_t>& fixed) {
  std::vector<Vec3> places;
  for (const std::uint32_t p : split.position_of) places.push_back(frame.positions[p]);
  std::vector<Triangle> free, stay;
  for (std::size_t t = 0; t < split.triangles.size(); ++t)
    (fixed[t] ? stay : free).push_back(split.triangles[t]);
  if (free.empty()) return stay;
  std::vector<Triangle> left(free.size());
  const std::size_t indices =
      meshopt_simplify(left.front().v, free.front().v, 3 * free.size(), &places.front().x,
                       places.size(), sizeof(Vec3), 0, error, meshopt_SimplifyLockBorder, nullptr);
  left.resize(indices / 3);
  left.insert(left.end(), stay.begin(), stay.end());
  return left;
}

std::vector<Triangle> at_positions(const SplitSurface& split, const std::vector<Triangle>& left) {
  std::vector<Triangle> triangles;
  for (const Triangle& t : left)
    triangles.push_back(
        {{split.position_of[t.v[0]], split.position_of[t.v[1]], split.position_of[t.v[2]]}});
  return triangles;
}

/// Points at the middles of triangles and of their edges.
std::vector<Vec3> middles(const SurfaceFrame& frame, const std::vector<Triangle>& triangles) {
  std::vector<Vec3> points;
  for (const Triangle& t : triangles) {
    const Vec3 a = frame.positions[t.v[0]], b = frame.positions[t.v[1]],
               c = frame.positions[t.v[2]];
    points.insert(points.end(), {(a + b + c) / 3, (a + b) / 2, (b + c) / 2, (c + a) / 2});
  }
  return points;
}

/// The larger of both one-sided distances, from points and middles. The triangles of the frame
/// where it is above `limit`, and those around them, become `fixed`.
float distance_between(const SurfaceFrame& frame, const ClosestPointQuery& before,
                       const std::vector<Triangle>& left, float limit,
                       std::vector<std::uint8_t>& fixed) {
  const ClosestPointQuery after(frame.positions, left);
  float farthest = 0;
  std::vector<std::uint8_t> near(frame.positions.size(), 0);
  const std::vector<ClosestPoint> own = after.closest(frame.positions);
  for (std::size_t i = 0; i < own.size(); ++i) {
    farthest = std::max(farthest, own[i].distance);
    if (own[i].distance > limit) near[i] = 1;
  }
  for (const ClosestPoint& hit : before.closest(middles(frame, left))) {
    farthest = std::max(farthest, hit.distance);
    if (hit.distance > limit)
      for (const std::uint32_t v : frame.triangles[hit.triangle].v) near[v] = 1;
  }
  if (farthest <= limit) return farthest;
  for (int ring = 0; ring < 1; ++ring) {
    std::vector<std::uint8_t> wider = near;
    for (std::size_t t = 0; t < frame.triangles.size(); ++t) {
      const auto& v = frame.triangles[t].v;
      if (!near[v[0]] && !near[v[1]] && !near[v[2]]) continue;
      fixed[t] = 1;
      for (const std::uint32_t p : v) wider[p] = 1;
    }
    near = std::move(wider);
  }
  return farthest;
}

/// Keeps what the triangles `left` need.
void keep(const SplitSurface& split, const std::vector<Triangle>& left, SurfaceFrame& frame) {
  SurfaceFrame kept;
  kept.is_model = frame.is_model;
  kept.is_mixed = frame.is_mixed;
  kept.mixture = frame.mixture;
  kept.materials = frame.materials;
  std::vector<std::uint32_t> number(frame.positions.size(), 0xffffffffu);
  const auto take = [](const auto& from, std::size_t i, auto& to) {
    if (!from.empty()) to.push_back(from[i]);
  };
  for (const Triangle& t : left) {
    Triangle& made = kept.triangles.emplace_back();
    take(frame.triangle_materials, split.corner_of[t.v[0]] / 3, kept.triangle_materials);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t p = split.position_of[t.v[k]];
      if (number[p] == 0xffffffffu) {
        number[p] = static_cast<std::uint32_t>(kept.positions.size());
        take(frame.positions, p, kept.positions);
        take(frame.normals, p, kept.normals);
        take(frame.velocities, p, kept.velocities);
        take(frame.colors, p, kept.colors);
        take(frame.labels, p, kept.labels);
      }
      made.v[k] = number[p];
      take(frame.corner_uvs, split.corner_of[t.v[k]], kept.corner_uvs);
      take(frame.corner_normals, split.corner_of[t.v[k]], kept.corner_normals);
    }
  }
  frame = std::move(kept);
}

}  // namespace

float simplify(SurfaceFrame& frame, float distance) {
  constexpr int kTries = 12;
  if (frame.triangles.empty()) return 0;
  const float extent = [&] {
    const Vec3 size = box_of(frame.positions).size();
    return std::max({size.x, size.y, size.z});
  }();
  if (!(extent > 0)) return 0;
  const SplitSurface split = split_corners(frame, {true, true});
  const ClosestPointQuery before(frame.positions, frame.triangles);
  std::vector<std::uint8_t> fixed(frame.triangles.size(), 0);
  // The library's own measure is a mean distance from planes: where it is too far off, a part of
  // the surface is left as it was.
  float error = 0.5f * distance / extent;
  for (int i = 0; i < kTries; ++i) {
    const std::vector<Triangle> left = collapsed(frame, split, error, fixed);
    const float reached =
        distance_between(frame, before, at_positions(split, left), distance, fixed);
    if (reached <= distance) {
      keep(split, left, frame);
      return reached;
    }
    error *= 0.95f;
  }
  return 0;
}

}  // namespace polymorph
