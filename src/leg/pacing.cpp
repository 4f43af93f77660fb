#include "leg/pacing.h"

#include <algorithm>
#include <string_view>

#include "base/cache_file.h"
#include "base/hash.h"
#include "leg/distance_leg.h"
#include "mesh/closest.h"
#include "mesh/components.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

constexpr int kSteps = 12;  ///< even steps that are measured first, and between levels
constexpr int kTimes = 24;  ///< steps between the times of the pace

/// A moment of a leg whose time is not yet invert_pacing.
struct Moment {
  float time = 0;   ///< time of the motion, [0, 1]
  float level = 0;  ///< level that keeps the volume
  Mesh surface;
  double change = 0;  ///< change since the moment before
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

float step_time(int k) { return static_cast<float>(k) / static_cast<float>(kSteps); }

/// Times at which 0, 1 / kTimes, ... 1 of the change is done, or of what is made of it: a part of
/// the pace is left to the time itself, so that it goes on where nothing changes.
std::vector<float> even_times(const std::vector<Moment>& moments, double change) {
  constexpr double kOwnShare = 0.43;
  std::vector<double> done;
  double sum = 0;
  for (const Moment& moment : moments) {
    sum += moment.change;
    done.push_back((1 - kOwnShare) * sum / change + kOwnShare * static_cast<double>(moment.time));
  }
  std::vector<float> times{0};
  for (int k = 1; k < kTimes; ++k) {
    const double share = static_cast<double>(k) / kTimes;
    const auto next =
        static_cast<std::size_t>(std::upper_bound(done.begin(), done.end(), share) - done.begin());
    const double within = (share - done[next - 1]) / (done[next] - done[next - 1]);
    times.push_back(lerp(moments[next - 1].time, moments[next].time, static_cast<float>(within)));
  }
  times.push_back(1);
  return times;
}

/// Level between those of the moments around.
float level_near(const std::vector<Moment>& moments, float time) {
  std::size_t next = 1;
  while (next + 1 < moments.size() && moments[next].time < time) ++next;
  const Moment &a = moments[next - 1], &b = moments[next];
  return lerp(a.level, b.level, (time - a.time) / (b.time - a.time));
}

/// Hash of everything that the surfaces at these moments depend on: the maps and both objects.
std::string cache_key(const Leg& leg, const std::vector<FrameMap>& maps) {
  Hasher hasher;
  const LegSettings& settings = leg.settings;
  hasher.add("pacing").add(kPacingVersion).add(settings.cell).add(settings.cell);
  hasher.add(settings.min_component_share);
  hasher.add(static_cast<std::uint8_t>(leg.plan.motion.keep_volume ? 1 : 0));
  for (const PreparedObject* object : {leg.from.get(), leg.to.get()})
    hasher.add(object->distances.key).add(object->model.box().diagonal());
  for (const FrameMap& map : maps) {
    const Regression& regression = *map.regression;
    hasher.add(std::span<const RegressionSample>(regression.samples));
    hasher.add(std::span<const BallAttribute>(regression.values));
    hasher.add(std::span<const AffineMap>(regression.affine));
    hasher.add_bytes(&regression.lattice, sizeof regression.lattice);
    if (!regression.landmarks.empty())
      hasher.add(std::span<const RegressionLandmark>(regression.landmarks));
    hasher.add(map.from_scale).add(map.to_scale);
    hasher.add_bytes(&map.box, sizeof map.box);
  }
  return hasher.hex();
}
// No padding is hashed.
static_assert(sizeof(BallAttribute) == 16 * sizeof(float) &&
              sizeof(RegressionSample) == 5 * sizeof(float) &&
              sizeof(RegressionLandmark) == 10 * sizeof(float) &&
              sizeof(Grid) == 7 * sizeof(float) && sizeof(Box) == 6 * sizeof(float));

std::optional<Pacing> load_pacing(const std::filesystem::path& cache, const std::string& key) {
  if (cache.empty()) return std::nullopt;
  const auto bytes = load_cached(cache, key, kPacingFiles);
  if (!bytes) return std::nullopt;
  const char* problem = nullptr;
  const auto content = cached_content(*bytes, key, kPacingFiles, problem);
  if (!content) return std::nullopt;
  std::string_view unread = *content;
  constexpr std::size_t kTimesSize = (kTimes + 1) * sizeof(float),
                        kLevelsSize = (kSteps + 1) * sizeof(float);
  if (!unread.empty() && unread.size() != kTimesSize && unread.size() != kTimesSize + kLevelsSize)
    return std::nullopt;
  Pacing pacing;
  if (!unread.empty()) pacing.times = take_all<float>(unread, kTimes + 1);
  if (!unread.empty()) pacing.levels = take_all<float>(unread, kSteps + 1);
  return pacing;
}

void store_pacing(const std::filesystem::path& cache, const std::string& key, const Leg& leg,
                  const Pacing& pacing) {
  if (cache.empty()) return;
  std::string bytes;
  put_all(bytes, pacing.times);
  put_all(bytes, pacing.levels);
  store_cached(cache, key, kPacingFiles, leg.from->name + ", " + leg.to->name, bytes);
}

/// The surface of a leg whose eased time is `time` itself.
Result<LegSurface> measured_surface(const Leg& linear, float time, const LevelSearch& search,
                                    Engine& engine) {
  LegSurface surface;
  surface.state.time = surface.state.u = time;
  surface.state.balls = balls_at(linear.plan, time);
  surface.state.map = distance_map(linear, time, surface.state.balls);
  PM_TRY_STATUS(extract_between(linear, search, engine, surface));
  return surface;
}

/// The moment of a leg at a time, on cells as frames have them but none too small: a dozen surfaces
/// and more are held at once. `near`: its level, about.
Result<Moment> measure_moment(const Leg& linear, float time, std::optional<float> near,
                              Engine& engine) {
  constexpr float kMaxResolution = 128;
  constexpr double kTolerance = 0.01;  // five times that of frames
  const LegSettings& settings = linear.settings;
  const float cell =
      settings.cell * std::max(1.0f, static_cast<float>(settings.resolution) / kMaxResolution);
  PM_TRY(LegSurface surface,
         measured_surface(linear, time, {cell, settings.measured, near, kTolerance}, engine));
  // A component that has come off counts when it is left out of the picture.
  remove_small_components(surface.mesh, min_component_share(linear));
  return Moment{time, surface.field.level, std::move(surface.mesh), 0};
}

/// Measures the quarters of steps within which more changes than elsewhere, where a limb grows
/// perhaps. They share what the whole step changes: of a part that shrinks, mean distances tell the
/// square of how far it went.
Result<std::vector<Moment>> refine(const Leg& linear, std::vector<Moment> steps, double change,
                                   Engine& engine) {
  constexpr double kMuch = 1.5;  // times the mean step
  constexpr int kParts = 4;
  std::vector<Moment> moments;
  for (Moment& step : steps) {
    if (step.change * kSteps > kMuch * change) {
      const std::size_t before = moments.size() - 1;
      const float time = moments[before].time, level = moments[before].level;
      double sum = 0;
      for (int i = 1; i < kParts; ++i) {
        const float t = static_cast<float>(i) / kParts;
        PM_TRY(Moment part, measure_moment(linear, lerp(time, step.time, t),
                                           lerp(level, step.level, t), engine));
        if (part.surface.triangles.empty()) continue;
        sum += part.change = change_between(moments.back().surface, part.surface);
        moments.push_back(std::move(part));
      }
      const double step_change = step.change;
      sum += step.change = change_between(moments.back().surface, step.surface);
      const double share = sum > 0 ? step_change / sum : 0;
      step.change *= share;
      for (std::size_t i = before + 1; i < moments.size(); ++i) moments[i].change *= share;
    }
    moments.push_back(std::move(step));
  }
  return moments;
}

/// kSteps + 1 moments at even times, fewer where one has no surface.
Result<std::vector<Moment>> measure_steps(const Leg& linear, Engine& engine) {
  std::vector<Moment> steps;
  for (int k = 0; k <= kSteps; ++k) {
    std::optional<float> near;
    if (k > 2) near = 2 * steps[steps.size() - 1].level - steps[steps.size() - 2].level;
    PM_TRY(Moment moment, measure_moment(linear, step_time(k), near, engine));
    if (moment.surface.triangles.empty()) break;
    if (k > 0) moment.change = change_between(steps.back().surface, moment.surface);
    steps.push_back(std::move(moment));
  }
  return steps;
}

/// Levels at even times of the leg at its pace.
Result<std::vector<float>> measure_levels(const Leg& invert_pacing,
                                          const std::vector<Moment>& moments, Engine& engine) {
  constexpr double kTolerance = 0.0005;  // a fourth of that of frames: most are at their first try
  std::vector<float> levels;
  if (!keeps_volume(invert_pacing)) return levels;
  for (int k = 0; k <= kSteps; ++k) {
    const float time = invert_pacing.plan.pacing[static_cast<std::size_t>(k * kTimes / kSteps)];
    PM_TRY(const LegSurface surface,
           measured_surface(invert_pacing, step_time(k),
                            {2 * invert_pacing.settings.cell, invert_pacing.settings.measured,
                             level_near(moments, time), kTolerance},
                            engine));
    levels.push_back(surface.field.level);
  }
  return levels;
}

}  // namespace

Result<Pacing> measure_pacing(const Leg& leg, Engine& engine, const std::filesystem::path& cache) {
  Leg linear = leg;
  linear.plan.motion.easing = Easing::kLinear;
  std::string key;
  if (!cache.empty()) {
    std::vector<FrameMap> maps;
    for (int k = 0; k <= kSteps; ++k)
      maps.push_back(distance_map(linear, step_time(k), balls_at(linear.plan, step_time(k))));
    key = cache_key(leg, maps);
  }
  if (auto stored = load_pacing(cache, key)) return std::move(*stored);
  PM_TRY(std::vector<Moment> steps, measure_steps(linear, engine));
  Pacing pacing;
  double change = 0;
  for (const Moment& step : steps) change += step.change;
  if (steps.size() == kSteps + 1 && change > 0) {
    PM_TRY(const std::vector<Moment> moments, refine(linear, std::move(steps), change, engine));
    pacing.times = linear.plan.pacing = even_times(moments, change);
    PM_TRY(pacing.levels, measure_levels(linear, moments, engine));
  }
  store_pacing(cache, key, leg, pacing);
  return pacing;
}

}  // namespace polymorph
