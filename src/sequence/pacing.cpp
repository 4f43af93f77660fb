#include "sequence/pacing.h"

#include <algorithm>
#include <string_view>

#include "base/cache_file.h"
#include "base/hash.h"
#include "mesh/closest.h"
#include "mesh/components.h"
#include "morph/motion.h"
#include "sequence/geometry/leg_surface.h"

namespace polymorph {
namespace {

constexpr int kSteps = 12;  ///< even ones that are measured first, and between levels
constexpr int kTimes = 24;  ///< between the times of the pace

/// A moment of a leg whose time is not yet paced.
struct Moment {
  float time = 0;   ///< in [0, 1]
  float level = 0;  ///< that keeps the volume
  Mesh surface;
  double change = 0;  ///< from the moment before
};

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

/// Mean distances there and back.
double change_between(const Mesh& a, const Mesh& b) {
  return mean_distance(a, ClosestPointQuery(b.positions, b.triangles)) +
         mean_distance(b, ClosestPointQuery(a.positions, a.triangles));
}

/// Where more is done within a step than elsewhere, a limb grows perhaps, its quarters are measured
/// too. They share what the whole step changes: of a part that shrinks, mean distances tell the
/// square of how far it went.
template <class Measure>
Result<std::vector<Moment>> refined(std::vector<Moment> steps, double whole,
                                    const Measure& measure) {
  constexpr double kMuch = 1.5;  // times the mean step
  constexpr int kParts = 4;
  std::vector<Moment> moments;
  for (Moment& step : steps) {
    if (step.change * kSteps > kMuch * whole) {
      const std::size_t before = moments.size() - 1;
      const float time = moments[before].time, level = moments[before].level;
      double sum = 0;
      for (int i = 1; i < kParts; ++i) {
        const float t = static_cast<float>(i) / kParts;
        PM_TRY(Moment part, measure(lerp(time, step.time, t), lerp(level, step.level, t)));
        if (part.surface.triangles.empty()) continue;
        sum += part.change = change_between(moments.back().surface, part.surface);
        moments.push_back(std::move(part));
      }
      const double change = step.change;
      sum += step.change = change_between(moments.back().surface, step.surface);
      const double share = sum > 0 ? change / sum : 0;
      step.change *= share;
      for (std::size_t i = before + 1; i < moments.size(); ++i) moments[i].change *= share;
    }
    moments.push_back(std::move(step));
  }
  return moments;
}

/// Times at which 0, 1 / kTimes, ... 1 of the change is done, or of what is made of it: a part of
/// the pace is left to the time itself, so that it goes on where nothing changes.
std::vector<float> evened(const std::vector<Moment>& moments, double whole) {
  constexpr double kOwnShare = 0.43;
  std::vector<double> done;
  double sum = 0;
  for (const Moment& moment : moments) {
    sum += moment.change;
    done.push_back((1 - kOwnShare) * sum / whole + kOwnShare * static_cast<double>(moment.time));
  }
  std::vector<float> times{0};
  for (int k = 1; k < kTimes; ++k) {
    const double wanted = static_cast<double>(k) / kTimes;
    const auto next =
        static_cast<std::size_t>(std::upper_bound(done.begin(), done.end(), wanted) - done.begin());
    const double within = (wanted - done[next - 1]) / (done[next] - done[next - 1]);
    times.push_back(lerp(moments[next - 1].time, moments[next].time, static_cast<float>(within)));
  }
  times.push_back(1);
  return times;
}

/// Between the levels of the moments around.
float level_near(const std::vector<Moment>& moments, float time) {
  std::size_t next = 1;
  while (next + 1 < moments.size() && moments[next].time < time) ++next;
  const Moment &a = moments[next - 1], &b = moments[next];
  return lerp(a.level, b.level, (time - a.time) / (b.time - a.time));
}

/// Raise it when the same maps and objects give other surfaces or another pacing.
constexpr std::uint32_t kPacingVersion = 13;

/// Everything that the surfaces at these moments depend on: the maps themselves and both objects.
std::string key_of(const PreparedActor& actor, const PreparedLeg& leg, float cell,
                   float min_component_share, const std::vector<FrameMap>& maps) {
  Hasher hasher;
  hasher.add("pacing").add(kPacingVersion).add(cell).add(actor.cell).add(min_component_share);
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
  const auto time_of = [](int k, int steps) {
    return static_cast<float>(k) / static_cast<float>(steps);
  };
  // The frames' own cells, but none smaller than at this resolution: a dozen surfaces and more are
  // held at once.
  constexpr float kResolution = 128;
  const float cell =
      actor.cell *
      std::max(1.0f, static_cast<float>(prepared.scene.surface.resolution) / kResolution);
  // Five times what frames are content with; and a fourth, so that most are at their first try.
  constexpr double kPaceTolerance = 0.01, kLevelTolerance = 0.0005;
  std::vector<FrameMap> maps;
  for (int k = 0; k <= kSteps; ++k)
    maps.push_back(
        map_at(actor, linear, time_of(k, kSteps), balls_at(linear.plan, time_of(k, kSteps))));
  const std::string key = cache.empty() ? std::string{}
                                        : key_of(actor, leg, actor.cell,
                                                 prepared.scene.surface.min_component_share, maps);
  if (!cache.empty())
    if (const auto bytes = load_cached(cache, key, kPacingFiles)) {
      const char* problem = nullptr;
      if (const auto content = cached_content(*bytes, key, kPacingFiles, problem)) {
        std::string_view rest = *content;
        constexpr std::size_t kTimesSize = (kTimes + 1) * sizeof(float),
                              kLevelsSize = (kSteps + 1) * sizeof(float);
        if (rest.empty() || rest.size() == kTimesSize || rest.size() == kTimesSize + kLevelsSize) {
          Pacing pacing;
          if (!rest.empty()) pacing.times = take_all<float>(rest, kTimes + 1);
          if (!rest.empty()) pacing.levels = take_all<float>(rest, kSteps + 1);
          return pacing;
        }
      }
    }
  std::vector<Moment> moments;
  const auto measure = [&](float time, std::optional<float> near) -> Result<Moment> {
    ActorGeometry geometry;
    geometry.moment.time = geometry.moment.u = time;
    geometry.balls = balls_at(linear.plan, time);
    geometry.map = map_at(actor, linear, time, geometry.balls);
    PM_TRY(SurfaceBetween surface, surface_between(actor, linear, geometry, cell, prepared.extract,
                                                   engine, {near, kPaceTolerance}));
    // What has come off counts when it is left out of the picture.
    remove_small_components(
        surface.mesh,
        min_component_share_of(actor, leg, prepared.scene.surface.min_component_share));
    return Moment{time, surface.field.level, std::move(surface.mesh), 0};
  };
  for (int k = 0; k <= kSteps; ++k) {
    std::optional<float> near;
    if (k > 2) near = 2 * moments[moments.size() - 1].level - moments[moments.size() - 2].level;
    PM_TRY(Moment moment, measure(time_of(k, kSteps), near));
    if (moment.surface.triangles.empty()) break;
    if (k > 0) moment.change = change_between(moments.back().surface, moment.surface);
    moments.push_back(std::move(moment));
  }
  Pacing pacing;
  double whole = 0;
  for (const Moment& moment : moments) whole += moment.change;
  if (moments.size() == kSteps + 1 && whole > 0) {
    PM_TRY(moments, refined(std::move(moments), whole, measure));
    pacing.times = evened(moments, whole);
    linear.plan.pacing = pacing.times;
    for (int k = 0; keeps_volume(actor, leg) && k <= kSteps; ++k) {
      ActorGeometry geometry;
      geometry.moment.time = geometry.moment.u = time_of(k, kSteps);
      geometry.balls = balls_at(linear.plan, time_of(k, kSteps));
      geometry.map = map_at(actor, linear, time_of(k, kSteps), geometry.balls);
      PM_TRY(const SurfaceBetween surface,
             surface_between(
                 actor, linear, geometry, 2 * actor.cell, prepared.extract, engine,
                 {level_near(moments, pacing.times[static_cast<std::size_t>(k * kTimes / kSteps)]),
                  kLevelTolerance}));
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
