#include "interchange/simplify.h"

#include <meshoptimizer.h>

#include <algorithm>

#include "interchange/split_surface.h"
#include "model/closest.h"

namespace polymorph {
namespace {

/// The triangles that are left, as vertices of the split surface.
std::vector<Triangle> collapsed(const SurfaceFrame& frame, const SplitSurface& split, float error) {
  std::vector<Vec3> places;
  for (const std::uint32_t p : split.position_of) places.push_back(frame.positions[p]);
  std::vector<Triangle> left(split.triangles.size());
  const std::size_t indices = meshopt_simplify(
      left.front().v, split.triangles.front().v, 3 * split.triangles.size(), &places.front().x,
      places.size(), sizeof(Vec3), 0, error);
  left.resize(indices / 3);
  return left;
}

std::vector<Triangle> at_positions(const SplitSurface& split, const std::vector<Triangle>& left) {
  std::vector<Triangle> triangles;
  for (const Triangle& t : left)
    triangles.push_back({{split.position_of[t.v[0]], split.position_of[t.v[1]],
                          split.position_of[t.v[2]]}});
  return triangles;
}

float farthest(const ClosestPointQuery& from, const std::vector<Vec3>& points) {
  float most = 0;
  for (const ClosestPoint& hit : from.closest(points)) most = std::max(most, hit.distance);
  return most;
}

/// The larger of both one-sided distances, at points and at the middles of triangles and edges.
float distance_between(const SurfaceFrame& frame, const std::vector<Triangle>& left) {
  const ClosestPointQuery before(frame.positions, frame.triangles);
  const ClosestPointQuery after(frame.positions, left);
  std::vector<Vec3> was = frame.positions, is;
  const auto add_middles = [&](const std::vector<Triangle>& triangles, std::vector<Vec3>& points) {
    for (const Triangle& t : triangles) {
      const Vec3 a = frame.positions[t.v[0]], b = frame.positions[t.v[1]],
                 c = frame.positions[t.v[2]];
      points.push_back((a + b + c) / 3);
      points.push_back((a + b) / 2);
      points.push_back((b + c) / 2);
      points.push_back((c + a) / 2);
    }
  };
  add_middles(left, is);
  return std::max(farthest(after, was), farthest(before, is));
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
  constexpr int kTries = 6;
  if (frame.triangles.empty()) return 0;
  const SplitSurface split = split_corners(frame, {true, true});
  Vec3 low = frame.positions.front(), high = low;
  for (const Vec3 p : frame.positions) {
    low = min(low, p);
    high = max(high, p);
  }
  const Vec3 size = high - low;
  const float extent = std::max({size.x, size.y, size.z});
  if (!(extent > 0)) return 0;
  // The library bounds the distance from planes, of which the surface's own is a small multiple.
  float error = distance / extent;
  for (int i = 0; i < kTries; ++i) {
    const std::vector<Triangle> left = collapsed(frame, split, error);
    if (left.empty()) {
      error /= 4;
      continue;
    }
    const float reached = distance_between(frame, at_positions(split, left));
    if (reached <= distance) {
      keep(split, left, frame);
      return reached;
    }
    error *= std::clamp(0.8f * distance / reached, 0.1f, 0.8f);
  }
  return 0;
}

}  // namespace polymorph
