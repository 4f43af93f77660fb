#include "leg/registration.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"
#include "field/extract_surface.h"
#include "leg/distance_leg.h"
#include "leg/map_fold.h"
#include "mesh/closest.h"
#include "mesh/normals.h"
#include "mesh/sample_surface.h"
#include "morph/motion.h"
#include "morph/smooth_map.h"

namespace polymorph {
namespace {

constexpr int kRounds = 12;
constexpr std::size_t kSamples = 2000;
/// Radius of the neighbourhood whose mean a pair's offset follows, a share of the objects' size.
constexpr float kRadius = 0.08f;
/// Farther than that, a share of the size, the closest point says nothing.
constexpr float kFarthest = 0.12f;
/// Cosine of the angle up to which normals agree.
constexpr float kAgree = 0.3f;
/// Share of the points whose normals must agree with the closest ones at first: where the plan
/// matches parts that are unlike, what is closest misleads.
constexpr double kLeastAgreement = 0.6;
/// Step of differences, a share of the size.
constexpr float kStepInSizes = 0.005f;
/// Halvings of the offsets, at most, until they fold the map nowhere.
constexpr int kHalvings = 6;

/// An object's surface.
struct Surface {
  Mesh mesh;
  std::vector<Vec3> normals;  ///< one per triangle
  std::vector<SurfaceSample> samples;
};

Result<Surface> make_surface(const PreparedObject& object, const LegSettings& settings,
                             Engine& engine) {
  Surface surface;
  PM_TRY(surface.mesh,
         extract_distances(engine, object.distances.grid, 2 * settings.cell, settings.measured));
  const MeshView view(surface.mesh.positions, surface.mesh.triangles);
  surface.normals = face_normals(view);
  surface.samples = sample_surface(view, kSamples);
  return surface;
}

/// One of a leg's maps at its start or end: the one to the other object.
struct EndMap {
  MorphPlan plan;
  float time = 0;  ///< 0: the map to the target; 1: that to the source
  BallSet balls;
  float size = 1;  ///< diagonal of the object that shows then

  EndMap(const Leg& leg, float end)
      : plan(leg.plan), time(end), balls(balls_at(leg.plan, end)), size(object_size(leg, end)) {
    plan.from_offsets.assign(plan.pairs.size(), {});
    plan.to_offsets.assign(plan.pairs.size(), {});
  }
  std::vector<Vec3>& offsets() { return time <= 0 ? plan.to_offsets : plan.from_offsets; }
  /// Marks the points that the map folds, by differences over half a hundredth of the size.
  Result<std::vector<std::uint8_t>> find_folds(const std::vector<Vec3>& points,
                                               Engine& engine) const {
    const std::array<std::size_t, 1> own{time <= 0 ? std::size_t{1} : std::size_t{0}};
    return polymorph::find_folds(frame_map(plan, time, balls, size).regression, own, points,
                                 kStepInSizes * size, engine);
  }
  Result<std::vector<Vec3>> carry(const std::vector<Vec3>& points, Engine& engine) const {
    PM_TRY(PullBack places, pull_back(frame_map(plan, time, balls, size), points, engine));
    return std::move(time <= 0 ? places.target : places.source);
  }
};

/// A vector at each sample, and whether it counts.
struct Residuals {
  std::vector<Vec3> vectors;
  std::vector<std::uint8_t> counts;
  std::size_t agreeing = 0;
};

/// Measures the way from each carried sample to the closest point of the other surface.
Result<Residuals> find_residuals(const EndMap& map, const Surface& own, const Surface& other,
                                 const ClosestPointQuery& closest, Engine& engine) {
  std::vector<Vec3> points;
  for (const SurfaceSample& sample : own.samples) {
    points.push_back(sample.point);
    points.push_back(sample.point + sample.normal * (kStepInSizes * map.size));
  }
  PM_TRY(const std::vector<Vec3> carried, map.carry(points, engine));
  std::vector<Vec3> at;
  for (std::size_t i = 0; i < carried.size(); i += 2) at.push_back(carried[i]);
  const std::vector<ClosestPoint> hits = closest.closest(at);
  Residuals residuals;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Vec3 normal = normalized(carried[2 * i + 1] - carried[2 * i]);
    const bool agrees = hits[i].distance < kFarthest * map.size &&
                        dot(normal, other.normals[hits[i].triangle]) > kAgree;
    residuals.vectors.push_back(hits[i].point - at[i]);
    residuals.counts.push_back(agrees ? 1 : 0);
    residuals.agreeing += agrees ? 1 : 0;
  }
  return residuals;
}

/// Moves each pair's offset by the mean of the residuals around its ball.
void follow(const Surface& own, const Residuals& residuals, EndMap& map) {
  constexpr float kInertia = 0.5f;  // of a ball that few samples are near to
  const float radius = kRadius * map.size;
  std::vector<Vec3>& offsets = map.offsets();
  parallel_for(
      static_cast<std::int64_t>(offsets.size()),
      [&](std::int64_t index) {
        const auto e = static_cast<std::size_t>(index);
        Vec3 sum;
        float weights = kInertia;
        for (std::size_t i = 0; i < own.samples.size(); ++i) {
          if (!residuals.counts[i]) continue;
          const Vec3 away = own.samples[i].point - map.balls[e].center;
          const float near = 1 - dot(away, away) / (radius * radius);
          if (near <= 0) continue;
          const float weight = near * near * near;
          sum = sum + residuals.vectors[i] * weight;
          weights += weight;
        }
        offsets[e] = offsets[e] + sum * (1 / weights);
      },
      16);
}

/// Halves the offsets around samples that they fold, until they fold none that is not folded
/// without them.
Status unfold(EndMap& map, const std::vector<Vec3>& points, const std::vector<std::uint8_t>& folded,
              Engine& engine) {
  const float radius = kRadius * map.size;
  for (int k = 0; k <= kHalvings; ++k) {
    PM_TRY(const std::vector<std::uint8_t> now, map.find_folds(points, engine));
    std::vector<Vec3> worse;
    for (std::size_t i = 0; i < now.size(); ++i)
      if (now[i] > folded[i]) worse.push_back(points[i]);
    if (worse.empty()) return Ok{};
    std::vector<Vec3>& offsets = map.offsets();
    for (std::size_t e = 0; e < offsets.size(); ++e)
      if (std::any_of(worse.begin(), worse.end(),
                      [&](Vec3 p) { return length(p - map.balls[e].center) < radius; }))
        offsets[e] = k < kHalvings ? offsets[e] * 0.5f : Vec3{};
  }
  return Ok{};
}

/// The offsets of one of the maps.
Result<std::vector<Vec3>> register_map(EndMap map, const Surface& own, const Surface& other,
                                       Engine& engine) {
  const ClosestPointQuery closest(other.mesh.positions, other.mesh.triangles);
  std::vector<Vec3> points;
  for (const SurfaceSample& sample : own.samples) points.push_back(sample.point);
  PM_TRY(const std::vector<std::uint8_t> folded, map.find_folds(points, engine));
  for (int round = 0; round < kRounds; ++round) {
    PM_TRY(const Residuals residuals, find_residuals(map, own, other, closest, engine));
    if (round == 0 && static_cast<double>(residuals.agreeing) <
                          kLeastAgreement * static_cast<double>(own.samples.size()))
      return std::move(map.offsets());
    follow(own, residuals, map);
  }
  PM_TRY_STATUS(unfold(map, points, folded, engine));
  return std::move(map.offsets());
}

}  // namespace

Result<Registration> register_surfaces(const Leg& leg, Engine& engine) {
  PM_TRY(const Surface from, make_surface(*leg.from, leg.settings, engine));
  PM_TRY(const Surface to, make_surface(*leg.to, leg.settings, engine));
  Registration registration;
  PM_TRY(registration.to_offsets, register_map(EndMap(leg, 0), from, to, engine));
  PM_TRY(registration.from_offsets, register_map(EndMap(leg, 1), to, from, engine));
  return registration;
}

}  // namespace polymorph
