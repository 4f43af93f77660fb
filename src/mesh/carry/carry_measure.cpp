#include "mesh/carry/carry_measure.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace polymorph {
namespace {

/// Fractions deviation_at the limit: distances below kNegligible are not resolved, others are
/// within kPrecision, and points deviation_at the surface beyond kMiss count as missed.
constexpr float kNegligible = 0.6f, kPrecision = 0.02f, kMiss = 0.4f;

void raise_to(CarryFault& fault, const Deviation& deviation) {
  for (const Deviation::PerTriangle& deviation_at : deviation.triangles)
    if (deviation_at.distance > fault.distance)
      fault.distance = deviation_at.distance, fault.position = deviation_at.position;
}

std::vector<std::uint32_t> find_inverted(std::span<const Vec3> points,
                                         std::span<const Triangle> triangles,
                                         const CarryTarget& target,
                                         std::span<const std::uint32_t> near) {
  std::vector<Vec3> middles(triangles.size());
  std::vector<std::uint32_t> hints(triangles.size()), inverted;
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const Triangle& t = triangles[f];
    middles[f] = (points[t.v[0]] + points[t.v[1]] + points[t.v[2]]) / 3;
    hints[f] = near[t.v[0]];
  }
  const std::vector<ClosestPoint> below = target.query().closest(middles, hints);
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const Vec3 own = area_normal(points, triangles[f]);
    if (!(dot(own, face_normal_at(target, middles[f], below[f], own)) > 0)) inverted.push_back(f);
  }
  return inverted;
}

}  // namespace

std::size_t CarryMeter::KeyHash::operator()(const Key& key) const {
  std::uint64_t hash = 0;
  for (const float x : key)
    hash = (std::rotl(hash, 27) ^ std::bit_cast<std::uint32_t>(x)) * 0x9e3779b97f4a7c15u;
  return hash ^ hash >> 32;
}

std::vector<std::uint32_t> CarryMeter::find_in_last_mesh(std::span<const Key> keys) const {
  std::vector<std::uint32_t> indices;
  for (const Key& key : keys) {
    const auto found = last_index_.find(key);
    indices.push_back(found == last_index_.end() ? KnownDeviation::kNew : found->second);
  }
  return indices;
}

CarryMeasure CarryMeter::measure(std::span<const Vec3> points,
                                 std::span<const Triangle> triangles) {
  const DeviationSettings settings{kNegligible * limit_, kPrecision * limit_, kMiss * limit_};
  const MeshQuery surface = target_.query();
  const ClosestPointQuery tree(points, triangles);
  const MeshQuery mesh{points, triangles, tree};
  std::vector<Key> keys;
  for (const Triangle& t : triangles) {
    const Vec3 a = points[t.v[0]], b = points[t.v[1]], c = points[t.v[2]];
    keys.push_back({a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z});
  }
  if (!mesh_to_surface_) {
    mesh_to_surface_ = measure_deviation({points, triangles}, surface, settings);
    surface_to_mesh_ = measure_deviation({surface.points, surface.triangles}, mesh, settings);
  } else {
    std::vector<std::uint32_t> old_index = find_in_last_mesh(keys), all(surface.triangles.size()),
                               new_index(mesh_to_surface_->triangles.size(), KnownDeviation::kNew);
    for (std::uint32_t f = 0; f < old_index.size(); ++f)
      if (old_index[f] != KnownDeviation::kNew) new_index[old_index[f]] = f;
    std::iota(all.begin(), all.end(), 0u);
    std::vector<std::uint32_t> mesh_near = surface_to_mesh_->nearest;
    for (std::uint32_t& t : mesh_near) t = new_index[t];
    const KnownDeviation out{*mesh_to_surface_, std::move(old_index), {}, true},
        in{*surface_to_mesh_, std::move(all), std::move(new_index), false};
    Deviation nearer = measure_deviation({surface.points, surface.triangles}, mesh, settings,
                                         std::move(mesh_near), &in);
    mesh_to_surface_ =
        measure_deviation({points, triangles}, surface, settings, mesh_to_surface_->nearest, &out);
    surface_to_mesh_ = std::move(nearer);
  }
  last_index_.clear();
  for (std::uint32_t f = 0; f < keys.size(); ++f) last_index_.emplace(keys[f], f);

  CarryMeasure m;
  raise_to(m.fault, *mesh_to_surface_);
  raise_to(m.fault, *surface_to_mesh_);
  for (const Deviation::PerTriangle& deviation_at : mesh_to_surface_->triangles)
    m.triangle_distance.push_back(deviation_at.distance);
  for (const Deviation::PerTriangle& deviation_at : surface_to_mesh_->triangles)
    for (const Deviation::Listed& miss : deviation_at.listed) {
      m.triangle_distance[miss.triangle] =
          std::max(m.triangle_distance[miss.triangle], miss.distance);
      m.misses.push_back(miss);
    }
  m.near = mesh_to_surface_->nearest;
  m.mesh_near = surface_to_mesh_->nearest;
  m.inverted = find_inverted(points, triangles, target_, m.near);
  m.fault.inverted = m.inverted.size();
  if (!m.inverted.empty()) m.fault.inverted_position = points[triangles[m.inverted.front()].v[0]];
  return m;
}

bool is_better(const CarryFault& a, const CarryFault& b) {
  return a.inverted != b.inverted ? a.inverted < b.inverted : a.distance < b.distance;
}

}  // namespace polymorph
