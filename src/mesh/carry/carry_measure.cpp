#include "mesh/carry/carry_measure.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "base/parallel.h"

namespace polymorph {
namespace {

/// DeviationSettings::negligible, ::sufficient, ::precision and ::listed (beyond which the mesh
/// misses a point of the surface), as fractions of the limit.
constexpr float kNegligible = 0.8f, kSufficient = 0.4f, kPrecision = 0.02f, kMiss = 0.5f;

void raise_to_maximum(CarryFault& fault, const Deviation& deviation) {
  for (const Deviation::PerTriangle& triangle : deviation.triangles)
    if (triangle.distance > fault.distance)
      fault.distance = triangle.distance, fault.position = triangle.position;
}

/// Guesses a triangle of the mesh near each point of the surface, from the triangles of the surface
/// that are near the mesh's points: the guesses spread along the surface.
std::vector<std::uint32_t> guess_nearest(std::span<const Triangle> triangles,
                                         const CarryTarget& target,
                                         std::span<const std::uint32_t> near) {
  const Mesh& surface = target.surface;
  std::vector<std::uint32_t> guesses(surface.positions.size(), ClosestPoint::kNoTriangle), queue;
  const auto guess = [&](std::uint32_t point, std::uint32_t triangle) {
    if (guesses[point] == ClosestPoint::kNoTriangle)
      guesses[point] = triangle, queue.push_back(point);
  };
  for (std::uint32_t f = 0; f < triangles.size(); ++f)
    for (const std::uint32_t v : triangles[f].v)
      if (v < near.size() && near[v] < surface.triangles.size())
        for (const std::uint32_t p : surface.triangles[near[v]].v) guess(p, f);
  for (std::size_t q = 0; q < queue.size(); ++q)
    for (const std::uint32_t f : target.fans.around(queue[q]))
      for (const std::uint32_t p : surface.triangles[f].v) guess(p, guesses[queue[q]]);
  return guesses;
}

}  // namespace

std::vector<std::uint32_t> find_inverted(std::span<const Vec3> points,
                                         std::span<const Triangle> triangles,
                                         const CarryTarget& target,
                                         std::span<const std::uint32_t> near) {
  std::vector<std::uint8_t> is_inverted(triangles.size());
  parallel_for(
      static_cast<std::int64_t>(triangles.size()),
      [&](std::int64_t f) {
        const Triangle& t = triangles[f];
        const Vec3 middle = (points[t.v[0]] + points[t.v[1]] + points[t.v[2]]) / 3,
                   normal = area_normal(points, t);
        const ClosestPoint hit = closest_near(target, middle, near[t.v[0]]);
        // Triangles without area and NaN count as inverted, too.
        is_inverted[f] = !(dot(normal, face_normal_at(target, middle, hit, normal)) > 0);
      },
      /*grain=*/256);
  std::vector<std::uint32_t> inverted;
  for (std::uint32_t f = 0; f < is_inverted.size(); ++f)
    if (is_inverted[f]) inverted.push_back(f);
  return inverted;
}

std::vector<float> list_badness(const CarryMeasure& measure, float limit) {
  std::vector<float> badness;
  for (const float distance : measure.triangle_distance) {
    const float beyond = std::max(distance / limit - 0.9f, 0.0f);
    badness.push_back(beyond * beyond);
  }
  for (const std::uint32_t f : measure.inverted) badness[f] += 1;
  return badness;
}

std::size_t CarryMeter::KeyHash::operator()(const Key& key) const {
  std::uint64_t hash = 0;
  for (const float x : key)
    hash = (std::rotl(hash, 27) ^ std::bit_cast<std::uint32_t>(x)) *
           0x9e3779b97f4a7c15u;  // 2^64 / golden ratio
  return hash ^ hash >> 32;
}

std::vector<std::uint32_t> CarryMeter::find_in_last_mesh(std::span<const Key> keys) const {
  std::vector<std::uint32_t> indices;
  for (const Key& key : keys) {
    const auto entry = last_index_.find(key);
    indices.push_back(entry == last_index_.end() ? KnownDeviation::kNew : entry->second);
  }
  return indices;
}

CarryMeasure CarryMeter::measure(std::span<const Vec3> points, std::span<const Triangle> triangles,
                                 std::span<const std::uint32_t> near) {
  const DeviationSettings settings{kNegligible * limit_, kPrecision * limit_, kMiss * limit_,
                                   kSufficient * limit_};
  const MeshQuery surface = target_.query();
  const ClosestPointQuery tree(points, triangles);
  const Fans fans(points.size(), triangles);
  const MeshQuery mesh{points, triangles, tree, &fans};
  std::vector<Key> keys;
  for (const Triangle& t : triangles) {
    const Vec3 a = points[t.v[0]], b = points[t.v[1]], c = points[t.v[2]];
    keys.push_back({a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z});
  }
  // Measure both directions, at first in full and later only what has changed.
  if (!mesh_to_surface_) {
    mesh_to_surface_ =
        measure_deviation({points, triangles}, surface, settings, {near.begin(), near.end()});
    surface_to_mesh_ = measure_deviation({surface.points, surface.triangles}, mesh, settings,
                                         guess_nearest(triangles, target_, near));
  } else {
    std::vector<std::uint32_t> old_index = find_in_last_mesh(keys),
                               same_index(surface.triangles.size()),
                               new_index(mesh_to_surface_->triangles.size(), KnownDeviation::kNew);
    for (std::uint32_t f = 0; f < old_index.size(); ++f)
      if (old_index[f] != KnownDeviation::kNew) new_index[old_index[f]] = f;
    std::iota(same_index.begin(), same_index.end(), 0u);
    std::vector<std::uint32_t> mesh_near = surface_to_mesh_->nearest;
    for (std::uint32_t& t : mesh_near)  // a changed triangle usually keeps its index
      if (new_index[t] != KnownDeviation::kNew) t = new_index[t];
    const KnownDeviation known_mesh{
        *mesh_to_surface_, std::move(old_index), {}, /*is_other_same=*/true},
        known_surface{*surface_to_mesh_, std::move(same_index), std::move(new_index),
                      /*is_other_same=*/false};
    Deviation new_surface_to_mesh = measure_deviation(
        {surface.points, surface.triangles}, mesh, settings, std::move(mesh_near), &known_surface);
    mesh_to_surface_ = measure_deviation({points, triangles}, surface, settings,
                                         mesh_to_surface_->nearest, &known_mesh);
    surface_to_mesh_ = std::move(new_surface_to_mesh);
  }
  last_index_.clear();
  for (std::uint32_t f = 0; f < keys.size(); ++f) last_index_.emplace(keys[f], f);
  // Summarize both directions.
  CarryMeasure m;
  raise_to_maximum(m.fault, *mesh_to_surface_);
  raise_to_maximum(m.fault, *surface_to_mesh_);
  for (const Deviation::PerTriangle& triangle : mesh_to_surface_->triangles)
    m.triangle_distance.push_back(triangle.distance);
  for (const Deviation::PerTriangle& triangle : surface_to_mesh_->triangles)
    for (const Deviation::Listed& miss : triangle.listed) {
      m.triangle_distance[miss.triangle] =
          std::max(m.triangle_distance[miss.triangle], miss.distance);
      m.misses.push_back(miss);
    }
  m.near = mesh_to_surface_->nearest;
  m.mesh_near = surface_to_mesh_->nearest;
  m.inverted = find_inverted(points, triangles, target_, m.near);
  m.fault.inverted = m.inverted.size();
  double badness = 0;
  for (const float b : list_badness(m, limit_)) badness += static_cast<double>(b);
  m.badness = static_cast<float>(badness);
  if (!m.inverted.empty()) m.fault.inverted_position = points[triangles[m.inverted.front()].v[0]];
  return m;
}

}  // namespace polymorph
