#include "mesh/carry/carry_measure.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <unordered_map>

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
  // Divisions keep the order of the triangles, so most are found by walking through both meshes
  // side by side; the others are looked up.
  constexpr std::size_t kMaxSkip = 8;
  const std::size_t old_count = last_keys_.size();
  std::vector<std::uint32_t> indices(keys.size(), KnownDeviation::kNew);
  std::vector<std::uint8_t> is_found(old_count, 0);
  std::size_t old = 0;
  for (std::size_t f = 0; f < keys.size(); ++f)
    for (std::size_t k = old; k < std::min(old + kMaxSkip, old_count); ++k)
      if (last_keys_[k] == keys[f]) {
        indices[f] = static_cast<std::uint32_t>(k);
        is_found[k] = 1;
        old = k + 1;
        break;
      }
  std::unordered_map<Key, std::uint32_t, KeyHash> others;
  for (std::uint32_t k = 0; k < old_count; ++k)
    if (!is_found[k]) others.emplace(last_keys_[k], k);
  for (std::size_t f = 0; f < keys.size() && !others.empty(); ++f)
    if (indices[f] == KnownDeviation::kNew)
      if (const auto entry = others.find(keys[f]); entry != others.end())
        indices[f] = entry->second;
  return indices;
}

CarryMeasure CarryMeter::measure(std::span<const Vec3> points, std::span<const Triangle> triangles,
                                 std::span<const std::uint32_t> near) {
  const DeviationSettings settings{kNegligible * limit_, kPrecision * limit_, kMiss * limit_,
                                   kSufficient * limit_};
  DeviationSettings unlisted = settings;  // only the surface's points and witnesses are listed
  unlisted.listed = std::numeric_limits<float>::infinity();
  unlisted.are_witnesses_listed = false;
  const MeshQuery surface = target_.query();
  const ClosestPointQuery tree(points, triangles);
  const Fans fans(points.size(), triangles);
  const MeshQuery mesh{points, triangles, tree, &fans};
  std::vector<Key> keys;
  for (const Triangle& t : triangles) {
    const Vec3 a = points[t.v[0]], b = points[t.v[1]], c = points[t.v[2]];
    keys.push_back({a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z});
  }
  const std::vector<std::uint32_t> old_index = find_in_last_mesh(keys);
  // Measure both directions, at first in full and later only what has changed.
  if (!mesh_to_surface_) {
    mesh_to_surface_ =
        measure_deviation({points, triangles}, surface, unlisted, {near.begin(), near.end()});
    surface_to_mesh_ = measure_deviation({surface.points, surface.triangles}, mesh, settings,
                                         guess_nearest(triangles, target_, near));
  } else {
    std::vector<std::uint32_t> same_index(surface.triangles.size()),
        new_index(mesh_to_surface_->triangles.size(), KnownDeviation::kNew);
    for (std::uint32_t f = 0; f < old_index.size(); ++f)
      if (old_index[f] != KnownDeviation::kNew) new_index[old_index[f]] = f;
    std::iota(same_index.begin(), same_index.end(), 0u);
    std::vector<std::uint32_t> mesh_near = surface_to_mesh_->nearest;
    for (std::uint32_t& t : mesh_near)  // a changed triangle usually keeps its index
      if (new_index[t] != KnownDeviation::kNew) t = new_index[t];
    const KnownDeviation known_mesh{*mesh_to_surface_, old_index, {}, /*is_other_same=*/true},
        known_surface{*surface_to_mesh_, std::move(same_index), std::move(new_index),
                      /*is_other_same=*/false};
    Deviation new_surface_to_mesh = measure_deviation(
        {surface.points, surface.triangles}, mesh, settings, std::move(mesh_near), &known_surface);
    mesh_to_surface_ = measure_deviation({points, triangles}, surface, unlisted,
                                         mesh_to_surface_->nearest, &known_mesh);
    surface_to_mesh_ = std::move(new_surface_to_mesh);
  }
  last_keys_ = std::move(keys);
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
  // A triangle that has not changed faces as before.
  std::vector<std::uint8_t> is_inverted(triangles.size());
  std::vector<std::uint32_t> new_triangles;
  for (std::uint32_t f = 0; f < triangles.size(); ++f)
    if (old_index[f] == KnownDeviation::kNew)
      new_triangles.push_back(f);
    else
      is_inverted[f] = last_is_inverted_[old_index[f]];
  std::vector<Triangle> changed;
  for (const std::uint32_t f : new_triangles) changed.push_back(triangles[f]);
  for (const std::uint32_t i : find_inverted(points, changed, target_, m.near))
    is_inverted[new_triangles[i]] = 1;
  for (std::uint32_t f = 0; f < triangles.size(); ++f)
    if (is_inverted[f]) m.inverted.push_back(f);
  last_is_inverted_ = std::move(is_inverted);
  m.fault.inverted = m.inverted.size();
  double badness = 0;
  for (const float b : list_badness(m, limit_)) badness += static_cast<double>(b);
  m.badness = static_cast<float>(badness);
  if (!m.inverted.empty()) m.fault.inverted_position = points[triangles[m.inverted.front()].v[0]];
  return m;
}

}  // namespace polymorph
