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

// "The size" is the diagonal of the box of the object from which a map leads (EndMap::size).
constexpr int kRounds = 12;             ///< iterations of closest points
constexpr std::size_t kSamples = 2000;  ///< points per surface
/// Radius of the neighbourhood over which residuals are averaged, as a fraction of the size.
constexpr float kRadius = 0.08f;
/// Maximum distance of a closest point that is used, as a fraction of the size.
constexpr float kMaxDistance = 0.12f;
/// Minimum cosine of the angle between normals that agree.
constexpr float kMinCosine = 0.3f;
/// Minimum fraction of points whose normals agree with those of their closest points before the
/// first round. Below it the plan matches unlike parts, and closest points would mislead.
constexpr double kMinAgreement = 0.6;
/// Step of finite differences, as a fraction of the size.
constexpr float kStepInSizes = 0.005f;
/// Maximum number of times that offsets are halved to unfold the map.
constexpr int kMaxHalvings = 6;

/// An object's surface, and samples of it.
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

/// The leg's map at one of the leg's ends, from the object at that end to the other object.
struct EndMap {
  MorphPlan plan;
  float time = 0;  ///< 0: the map to the target; 1: the map to the source
  BallSet balls;
  float size = 1;  ///< diagonal of the object at that end

  EndMap(const Leg& leg, float end)
      : plan(leg.plan), time(end), balls(balls_at(leg.plan, end)), size(object_size(leg, end)) {
    plan.from_offsets.assign(plan.pairs.size(), {});
    plan.to_offsets.assign(plan.pairs.size(), {});
  }
  std::vector<Vec3>& offsets() { return time <= 0 ? plan.to_offsets : plan.from_offsets; }
  /// Marks the points that the map folds, by finite differences.
  Result<std::vector<std::uint8_t>> find_folds(const std::vector<Vec3>& points,
                                               Engine& engine) const {
    const std::array<std::size_t, 1> map_index{time <= 0 ? std::size_t{1} : std::size_t{0}};
    return polymorph::find_folds(frame_map(plan, time, balls, size).regression, map_index, points,
                                 kStepInSizes * size, engine);
  }
  /// Maps points to the other object.
  Result<std::vector<Vec3>> carry(const std::vector<Vec3>& points, Engine& engine) const {
    PM_TRY(PullBack places, pull_back(frame_map(plan, time, balls, size), points, engine));
    return std::move(time <= 0 ? places.target : places.source);
  }
};

/// For each sample, the vector from its image to the closest point of the other surface, scene
/// units, and whether that point is near and the normals agree (1, else 0).
struct Residuals {
  std::vector<Vec3> vectors;
  std::vector<std::uint8_t> agrees;
  std::size_t agreeing = 0;  ///< number of samples that agree
};

/// Maps the samples and their normals, and compares them with the closest points of `other`.
Result<Residuals> find_residuals(const EndMap& map, const Surface& own, const Surface& other,
                                 const ClosestPointQuery& closest, Engine& engine) {
  std::vector<Vec3> points;
  for (const SurfaceSample& sample : own.samples) {
    points.push_back(sample.point);
    points.push_back(sample.point + sample.normal * (kStepInSizes * map.size));
  }
  PM_TRY(const std::vector<Vec3> carried, map.carry(points, engine));
  std::vector<Vec3> targets;
  for (std::size_t i = 0; i < carried.size(); i += 2) targets.push_back(carried[i]);
  const std::vector<ClosestPoint> closest_points = closest.closest(targets);
  Residuals residuals;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const Vec3 normal = normalized(carried[2 * i + 1] - carried[2 * i]);
    const bool agrees = closest_points[i].distance < kMaxDistance * map.size &&
                        dot(normal, other.normals[closest_points[i].triangle]) > kMinCosine;
    residuals.vectors.push_back(closest_points[i].point - targets[i]);
    residuals.agrees.push_back(agrees ? 1 : 0);
    residuals.agreeing += agrees ? 1 : 0;
  }
  return residuals;
}

/// Moves each pair's offset by the mean of the residuals around its ball.
void move_offsets(const Surface& own, const Residuals& residuals, EndMap& map) {
  // Weight of an additional residual of 0, which damps balls with few samples nearby.
  constexpr float kInertia = 0.5f;
  const float radius = kRadius * map.size;
  std::vector<Vec3>& offsets = map.offsets();
  parallel_for(
      static_cast<std::int64_t>(offsets.size()),
      [&](std::int64_t index) {
        const auto e = static_cast<std::size_t>(index);
        Vec3 sum;
        float weights = kInertia;
        for (std::size_t i = 0; i < own.samples.size(); ++i) {
          if (!residuals.agrees[i]) continue;
          const Vec3 offset = own.samples[i].point - map.balls[e].center;
          const float closeness = 1 - dot(offset, offset) / (radius * radius);
          if (closeness <= 0) continue;
          const float weight = closeness * closeness * closeness;
          sum = sum + residuals.vectors[i] * weight;
          weights += weight;
        }
        offsets[e] = offsets[e] + sum * (1 / weights);
      },
      /*grain=*/16);
}

/// Halves the offsets around the points at which they fold the map, until it folds only at the
/// points of `folded`, at which it folds without offsets. Offsets that still fold the map after
/// kMaxHalvings become 0.
Status unfold(EndMap& map, const std::vector<Vec3>& points, const std::vector<std::uint8_t>& folded,
              Engine& engine) {
  const float radius = kRadius * map.size;
  for (int k = 0; k <= kMaxHalvings; ++k) {
    PM_TRY(const std::vector<std::uint8_t> folded_now, map.find_folds(points, engine));
    std::vector<Vec3> newly_folded;
    for (std::size_t i = 0; i < folded_now.size(); ++i)
      if (folded_now[i] > folded[i]) newly_folded.push_back(points[i]);
    if (newly_folded.empty()) return Ok{};
    std::vector<Vec3>& offsets = map.offsets();
    for (std::size_t e = 0; e < offsets.size(); ++e)
      if (std::any_of(newly_folded.begin(), newly_folded.end(),
                      [&](Vec3 p) { return length(p - map.balls[e].center) < radius; }))
        offsets[e] = k < kMaxHalvings ? offsets[e] * 0.5f : Vec3{};
  }
  return Ok{};
}

/// Computes the offsets of one map by iterative closest points.
Result<std::vector<Vec3>> register_map(EndMap map, const Surface& own, const Surface& other,
                                       Engine& engine) {
  const ClosestPointQuery closest(other.mesh.positions, other.mesh.triangles);
  std::vector<Vec3> points;
  for (const SurfaceSample& sample : own.samples) points.push_back(sample.point);
  PM_TRY(const std::vector<std::uint8_t> folded, map.find_folds(points, engine));
  for (int round = 0; round < kRounds; ++round) {
    PM_TRY(const Residuals residuals, find_residuals(map, own, other, closest, engine));
    if (round == 0 && static_cast<double>(residuals.agreeing) <
                          kMinAgreement * static_cast<double>(own.samples.size()))
      return std::move(map.offsets());  // still 0
    move_offsets(own, residuals, map);
  }
  PM_TRY_STATUS(unfold(map, points, folded, engine));
  return std::move(map.offsets());
}

}  // namespace

Result<Registration> register_surfaces(const Leg& leg, Engine& engine) {
  PM_TRY(const Surface from, make_surface(*leg.from, leg.settings, engine));
  PM_TRY(const Surface to, make_surface(*leg.to, leg.settings, engine));
  Registration registration;
  PM_TRY(registration.to_offsets, register_map(EndMap(leg, /*end=*/0), from, to, engine));
  PM_TRY(registration.from_offsets, register_map(EndMap(leg, /*end=*/1), to, from, engine));
  return registration;
}

}  // namespace polymorph
