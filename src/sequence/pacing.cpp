#include "sequence/pacing.h"

#include <algorithm>
#include <string_view>

#include "base/cache_file.h"
#include "base/hash.h"
#include "model/query/closest.h"
#include "morph/motion.h"
#include "sequence/geometry/leg_surface.h"

namespace polymorph {
namespace {

constexpr int kSteps = 12;

/// Mean distance from some of a surface's vertices to another surface.
double mean_distance(const Mesh& from, const ClosestPointQuery& to) {
  constexpr std::size_t kSamples = 1500;
  const std::size_t stride = std::max<std::size_t>(1, from.positions.size() / kSamples);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < from.positions.size(); i += stride)
    points.push_back(from.positions[i]);
  double sum = 0;
  for (const ClosestPoint& at : to.closest(points)) sum += static_cast<double>(at.distance);
  return points.empty() ? 0 : sum / static_cast<double>(points.size());
}

/// Raise it when the same maps and objects give other surfaces or another pacing.
constexpr std::uint32_t kPacingVersion = 12;

/// Everything that the surfaces at these moments depend on: the maps themselves and both objects.
std::string key_of(const PreparedActor& actor, const PreparedLeg& leg, float cell,
                   const std::vector<FrameMap>& maps) {
  Hasher hasher;
  hasher.add("pacing").add(kPacingVersion).add(cell);
  hasher.add(static_cast<std::uint8_t>(leg.plan.motion.keep_volume ? 1 : 0));
  for (const std::size_t object : {leg.from, leg.to}) {
    const PreparedObject& o = actor.objects[object];
    hasher.add(o.distances.key).add(o.model.box().diagonal());
  }
  for (const FrameMap& map : maps) {
    const Regression& regression = *map.regression;
    hasher.add(std::span<const RegressionSample>(regression.samples));
    hasher.add(std::span<const BallAttribute>(regression.values));
    hasher.add(std::span<const AffineMap>(regression.affine));
    hasher.add_bytes(&regression.lattice, sizeof regression.lattice);
    hasher.add(map.from_scale).add(map.to_scale);
    hasher.add_bytes(&map.box, sizeof map.box);
  }
  return hasher.hex();
}
// No padding is hashed.
static_assert(sizeof(BallAttribute) == 16 * sizeof(float) &&
              sizeof(RegressionSample) == 5 * sizeof(float) && sizeof(Grid) == 7 * sizeof(float) &&
              sizeof(Box) == 6 * sizeof(float));

}  // namespace

Result<Pacing> even_pacing(const PreparedScene& prepared, const PreparedActor& actor,
                           const PreparedLeg& leg, Engine& engine,
                           const std::filesystem::path& cache) {
  PreparedLeg linear = leg;
  linear.plan.motion.easing = Easing::kLinear;
  linear.plan.pacing.clear();
  const auto time_of = [](int k) { return static_cast<float>(k) / kSteps; };
  const float cell = 3 * actor.cell;
  // A fourth of what frames are content with, so that most of them are at their first try.
  constexpr double kLevelTolerance = 0.0005;
  std::vector<FrameMap> maps;
  for (int k = 0; k <= kSteps; ++k)
    maps.push_back(map_at(actor, linear, time_of(k), balls_at(linear.plan, time_of(k))));
  const std::string key = cache.empty() ? std::string{} : key_of(actor, leg, cell, maps);
  if (!cache.empty())
    if (const auto bytes = load_cached(cache, key, kPacingFiles)) {
      const char* problem = nullptr;
      if (const auto content = cached_content(*bytes, key, kPacingFiles, problem)) {
        std::string_view rest = *content;
        constexpr std::size_t kEach = (kSteps + 1) * sizeof(float);
        if (rest.size() % kEach == 0 && rest.size() <= 2 * kEach) {
          Pacing pacing;
          if (!rest.empty()) pacing.times = take_all<float>(rest, kSteps + 1);
          if (!rest.empty()) pacing.levels = take_all<float>(rest, kSteps + 1);
          return pacing;
        }
      }
    }
  // A part of the pace is left to the eased time itself: where nothing changes it goes on.
  constexpr double kOwnShare = 0.4;
  std::vector<double> done{0};
  const auto geometry_at = [&](int k) {
    ActorGeometry geometry;
    geometry.moment.time = geometry.moment.u = time_of(k);
    geometry.balls = balls_at(linear.plan, time_of(k));
    return geometry;
  };
  Mesh before;
  bool empty = false;
  for (int k = 0; k <= kSteps && !empty; ++k) {
    ActorGeometry geometry = geometry_at(k);
    geometry.map = maps[static_cast<std::size_t>(k)];
    PM_TRY(SurfaceBetween surface,
           surface_between(actor, linear, geometry, cell, prepared.extract, engine));
    Mesh& mesh = surface.mesh;
    empty = mesh.triangles.empty();
    if (k > 0 && !empty)
      done.push_back(done.back() +
                     mean_distance(before, ClosestPointQuery(mesh.positions, mesh.triangles)) +
                     mean_distance(mesh, ClosestPointQuery(before.positions, before.triangles)));
    before = std::move(mesh);
  }
  Pacing pacing;
  if (!empty && done.back() > 0) {
    const double whole = done.back();
    for (int k = 0; k <= kSteps; ++k) {
      double& share = done[static_cast<std::size_t>(k)];
      share = (1 - kOwnShare) * share / whole + kOwnShare * k / kSteps;
    }
    pacing.times.push_back(0);
    for (int i = 1; i < kSteps; ++i) {
      const double wanted = static_cast<double>(i) / kSteps;
      const auto next = static_cast<std::size_t>(
          std::upper_bound(done.begin(), done.end(), wanted) - done.begin());
      const double within = (wanted - done[next - 1]) / (done[next] - done[next - 1]);
      pacing.times.push_back(static_cast<float>((static_cast<double>(next) - 1 + within) / kSteps));
    }
    pacing.times.push_back(1);
    linear.plan.pacing = pacing.times;
    for (int k = 0; keeps_volume(actor, leg) && k <= kSteps; ++k) {
      ActorGeometry geometry = geometry_at(k);
      geometry.map = map_at(actor, linear, time_of(k), geometry.balls);
      PM_TRY(const SurfaceBetween surface,
             surface_between(actor, linear, geometry, 2 * actor.cell, prepared.extract, engine,
                             kLevelTolerance));
      pacing.levels.push_back(surface.field.level);
    }
  }
  if (!cache.empty()) {
    std::string bytes;
    put_all(bytes, pacing.times);
    put_all(bytes, pacing.levels);
    store_cached(cache, key, kPacingFiles,
                 actor.objects[leg.from].name + ", " + actor.objects[leg.to].name, bytes);
  }
  return pacing;
}

}  // namespace polymorph
