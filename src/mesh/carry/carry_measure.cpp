#include "mesh/carry/carry_measure.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace polymorph {
namespace {

/// Shares of the limit: what is not told apart, how exact the rest is, what is a miss.
constexpr float kNegligible = 0.6f, kPrecision = 0.02f, kMiss = 0.4f;

void raise(CarryFault& fault, const Deviation& deviation) {
  for (const Deviation::OfTriangle& of : deviation.triangles)
    if (of.distance > fault.distance) fault.distance = of.distance, fault.place = of.place;
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

std::vector<std::uint32_t> CarryMeter::numbers_before(std::span<const Key> keys) const {
  std::vector<std::uint32_t> numbers;
  for (const Key& key : keys) {
    const auto found = last_.find(key);
    numbers.push_back(found == last_.end() ? KnownDeviation::kNew : found->second);
  }
  return numbers;
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
  if (!out_) {
    out_ = deviation(points, triangles, surface, settings);
    in_ = deviation(surface.points, surface.triangles, mesh, settings);
  } else {
    std::vector<std::uint32_t> then = numbers_before(keys), all(surface.triangles.size()),
                               now(out_->triangles.size(), KnownDeviation::kNew);
    for (std::uint32_t f = 0; f < then.size(); ++f)
      if (then[f] != KnownDeviation::kNew) now[then[f]] = f;
    std::iota(all.begin(), all.end(), 0u);
    std::vector<std::uint32_t> mesh_near = in_->nearest;
    for (std::uint32_t& t : mesh_near) t = now[t];
    const KnownDeviation out{*out_, std::move(then), {}, true},
        in{*in_, std::move(all), std::move(now), false};
    Deviation nearer =
        deviation(surface.points, surface.triangles, mesh, settings, std::move(mesh_near), &in);
    out_ = deviation(points, triangles, surface, settings, out_->nearest, &out);
    in_ = std::move(nearer);
  }
  last_.clear();
  for (std::uint32_t f = 0; f < keys.size(); ++f) last_.emplace(keys[f], f);

  CarryMeasure m;
  raise(m.fault, *out_);
  raise(m.fault, *in_);
  for (const Deviation::OfTriangle& of : out_->triangles) m.of_triangle.push_back(of.distance);
  for (const Deviation::OfTriangle& of : in_->triangles)
    for (const Deviation::Listed& miss : of.listed) {
      m.of_triangle[miss.triangle] = std::max(m.of_triangle[miss.triangle], miss.distance);
      m.misses.push_back(miss);
    }
  m.near = out_->nearest;
  m.mesh_near = in_->nearest;
  m.inverted = find_inverted(points, triangles, target_, m.near);
  m.fault.inverted = m.inverted.size();
  if (!m.inverted.empty()) m.fault.inverted_place = points[triangles[m.inverted.front()].v[0]];
  return m;
}

bool is_better(const CarryFault& a, const CarryFault& b) {
  return a.inverted != b.inverted ? a.inverted < b.inverted : a.distance < b.distance;
}

}  // namespace polymorph
