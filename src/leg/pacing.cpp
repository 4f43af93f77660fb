#include "leg/pacing.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/cache_file.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "field/extract_surface.h"
#include "leg/distance_leg.h"
#include "mesh/closest.h"
#include "mesh/components.h"
#include "mesh/mesh_check.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

constexpr int kSteps = 12;  ///< number of even time steps that are measured first; also of levels
constexpr int kTimes = 24;  ///< number of intervals of Pacing::times

/// The surface of a leg without pacing at one time of its motion, and measures of it.
struct Moment {
  float time = 0;          ///< time of the motion, [0, 1]
  LevelEstimate estimate;  ///< estimate of the level that keeps the volume
  float low = 0;           ///< height of the surface's lowest point
  Mesh surface;
  double change = 0;  ///< change_between() the previous surface and this one
};

/// Computes the mean distance from some of a surface's vertices to another surface.
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

/// Returns the sum of the mean distances from a to b and from b to a.
double change_between(const Mesh& a, const Mesh& b) {
  return mean_distance(a, ClosestPointQuery(b.positions, b.triangles)) +
         mean_distance(b, ClosestPointQuery(a.positions, a.triangles));
}

float step_time(int k) { return static_cast<float>(k) / static_cast<float>(kSteps); }

/// Computes the times at which the progress is 0, 1 / kTimes, ... 1. Progress is a weighted mean of
/// the fraction of the total `change` done and the time itself, so it always increases.
std::vector<float> even_times(const std::vector<Moment>& moments, double change) {
  constexpr double kTimeWeight = 0.43;
  std::vector<double> progress;
  double sum = 0;
  for (const Moment& moment : moments) {
    sum += moment.change;
    progress.push_back((1 - kTimeWeight) * sum / change +
                       kTimeWeight * static_cast<double>(moment.time));
  }
  std::vector<float> times{0};
  for (int k = 1; k < kTimes; ++k) {
    const double goal = static_cast<double>(k) / kTimes;
    const auto next = static_cast<std::size_t>(
        std::upper_bound(progress.begin(), progress.end(), goal) - progress.begin());
    const double fraction = (goal - progress[next - 1]) / (progress[next] - progress[next - 1]);
    times.push_back(lerp(moments[next - 1].time, moments[next].time, static_cast<float>(fraction)));
  }
  times.push_back(1);
  return times;
}

/// Interpolates a value between the two moments around `time`.
template <class Value>
float interpolate(const std::vector<Moment>& moments, float time, const Value& value) {
  std::size_t next = 1;
  while (next + 1 < moments.size() && moments[next].time < time) ++next;
  const Moment &a = moments[next - 1], &b = moments[next];
  return lerp(value(a), value(b), (time - a.time) / (b.time - a.time));
}

/// Interpolates the moments' levels at `time` by a cubic whose slopes at the moments are those of
/// the parabola through the nearest three. There must be at least three moments.
float cubic_level(const std::vector<Moment>& moments, float time) {
  const auto width = [&](std::size_t i) { return moments[i + 1].time - moments[i].time; };
  const auto chord = [&](std::size_t i) {
    return (moments[i + 1].estimate.level - moments[i].estimate.level) / width(i);
  };
  const std::size_t last = moments.size() - 1;
  const auto slope = [&](std::size_t i) {
    const std::size_t k = std::clamp<std::size_t>(i, 1, last - 1);  // middle of the nearest three
    const float middle =
        (width(k) * chord(k - 1) + width(k - 1) * chord(k)) / (width(k - 1) + width(k));
    return i == k ? middle : 2 * chord(i == 0 ? 0 : last - 1) - middle;
  };
  std::size_t next = 1;
  while (next < last && moments[next].time < time) ++next;
  const std::size_t k = next - 1;
  const float t = (time - moments[k].time) / width(k), t2 = t * t, t3 = t2 * t;
  return moments[k].estimate.level * (2 * t3 - 3 * t2 + 1) +
         moments[next].estimate.level * (3 * t2 - 2 * t3) +
         width(k) * (slope(k) * (t3 - 2 * t2 + t) + slope(next) * (t3 - t2));
}

/// Estimates the levels that keep the volume of a leg with its pacing, from those of the moments
/// before it was paced. The volume to be kept at a moment changes with the pace, because its
/// progress does.
std::vector<float> find_levels(const Leg& paced, const std::vector<Moment>& moments) {
  std::vector<float> levels;
  if (!keeps_volume(paced)) return levels;
  // Volume that a higher level encloses less, over the difference of the levels.
  const auto steepness = [](const Moment& moment) {
    return static_cast<float>(moment.estimate.response * area_of(moment.surface));
  };
  const auto growth = static_cast<float>(paced.to->distances.volume - paced.from->distances.volume);
  for (int k = 0; k <= kSteps; ++k) {
    const float time = paced.plan.pacing[static_cast<std::size_t>(k * kTimes / kSteps)];
    const float more_volume = (step_time(k) - time) * growth;
    levels.push_back(cubic_level(moments, time) -
                     more_volume / interpolate(moments, time, steepness));
  }
  return levels;
}

/// Tests whether the leg's surface must stay on the floor: if its settings ask for it and both
/// objects stand equally low. Arcs and explosions leave the floor on purpose.
bool stays_on_floor(const Leg& leg) {
  const Path path = leg.plan.motion.path;
  const float difference = leg.from->model.box().low.y - leg.to->model.box().low.y;
  return leg.settings.contact && path != Path::kBezier && path != Path::kExplode &&
         std::fabs(difference) <= kMaxFloorDifference * object_size(leg, 0.5f);
}

/// Computes the height by which a moment's surface is raised (lowered if negative) to stay on the
/// floor. The cells may miss thin feet, so its lowest point goes to where the extracted surfaces at
/// both ends have theirs. But it is raised no higher than the objects' own lowest points.
float find_lift(const Leg& leg, const std::vector<Moment>& moments, const Moment& moment) {
  const float t = moment.time;
  const float floor = lerp(leg.from->model.box().low.y, leg.to->model.box().low.y, t);
  const float lift = lerp(moments.front().low, moments.back().low, t) - moment.low;
  return std::min(lift, std::max(floor - moment.low, 0.0f));
}

/// Interpolates find_lift() at the times.
std::vector<float> find_lifts(const Leg& leg, const std::vector<Moment>& moments,
                              const std::vector<float>& times) {
  std::vector<float> lifts;
  for (const float time : times)
    lifts.push_back(interpolate(
        moments, time, [&](const Moment& moment) { return find_lift(leg, moments, moment); }));
  return lifts;
}

/// Finds the extreme points along -x, x, -y, y, -z and z of all moments' lifted surfaces.
std::vector<Vec3> find_extremes(const Leg& leg, const std::vector<Moment>& moments) {
  std::vector<Vec3> extremes(6, moments.front().surface.positions.front());
  for (const Moment& moment : moments) {
    const float lift = stays_on_floor(leg) ? find_lift(leg, moments, moment) : 0;
    for (Vec3 p : moment.surface.positions) {
      p.y += lift;
      int k = 0;
      for (float Vec3::*axis : {&Vec3::x, &Vec3::y, &Vec3::z}) {
        Vec3 &low = extremes[static_cast<std::size_t>(k++)],
             &high = extremes[static_cast<std::size_t>(k++)];
        if (p.*axis < low.*axis) low = p;
        if (p.*axis > high.*axis) high = p;
      }
    }
  }
  return extremes;
}

/// Hashes everything that the measured surfaces depend on: maps, objects and settings.
std::string cache_key(const Leg& leg, const std::vector<FrameMap>& maps) {
  Hasher hasher;
  const LegSettings& settings = leg.settings;
  hasher.add("pacing").add(kPacingVersion).add(settings.cell).add(settings.resolution);
  hasher.add(settings.min_component_share);
  hasher.add(static_cast<std::uint8_t>(leg.plan.motion.keep_volume ? 1 : 0));
  hasher.add(static_cast<std::uint8_t>(stays_on_floor(leg) ? 1 : 0));
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
// The hashed structs have no padding.
static_assert(sizeof(BallAttribute) == 16 * sizeof(float) &&
              sizeof(RegressionSample) == 5 * sizeof(float) &&
              sizeof(RegressionLandmark) == 10 * sizeof(float) &&
              sizeof(Grid) == 7 * sizeof(float) && sizeof(Box) == 6 * sizeof(float));

std::optional<Pacing> load_pacing(const std::filesystem::path& cache, const std::string& key,
                                  const Leg& leg) {
  if (cache.empty()) return std::nullopt;
  const auto bytes = load_cached(cache, key, kPacingFiles);
  if (!bytes) return std::nullopt;
  const char* problem = nullptr;
  const auto content = cached_content(*bytes, key, kPacingFiles, problem);
  if (!content) return std::nullopt;
  std::string_view unread = *content;
  constexpr std::size_t kTimesSize = (kTimes + 1) * sizeof(float),
                        kLevelsSize = (kSteps + 1) * sizeof(float);
  // The file holds two offsets per pair of the plan, then four flags that say which lists follow.
  const std::size_t pairs = leg.plan.pairs.size();
  if (unread.size() < 2 * pairs * sizeof(Vec3) + 4) return std::nullopt;
  Pacing pacing;
  pacing.registration.from_offsets = take_array<Vec3>(unread, pairs);
  pacing.registration.to_offsets = take_array<Vec3>(unread, pairs);
  const bool has_times = unread[0] != 0, has_levels = unread[1] != 0, has_lifts = unread[2] != 0,
             has_extremes = unread[3] != 0;
  unread.remove_prefix(4);
  if (unread.size() != (has_times ? kTimesSize : 0) + (has_levels ? kLevelsSize : 0) +
                           (has_lifts ? kTimesSize : 0) + (has_extremes ? 6 * sizeof(Vec3) : 0))
    return std::nullopt;
  if (has_times) pacing.times = take_array<float>(unread, kTimes + 1);
  if (has_levels) pacing.levels = take_array<float>(unread, kSteps + 1);
  if (has_lifts) pacing.lifts = take_array<float>(unread, kTimes + 1);
  if (has_extremes) pacing.extremes = take_array<Vec3>(unread, 6);
  return pacing;
}

void store_pacing(const std::filesystem::path& cache, const std::string& key, const Leg& leg,
                  const Pacing& pacing) {
  if (cache.empty()) return;
  std::string bytes;
  put_array(bytes, pacing.registration.from_offsets);
  put_array(bytes, pacing.registration.to_offsets);
  for (const std::vector<float>* list : {&pacing.times, &pacing.levels, &pacing.lifts})
    bytes += list->empty() ? '\0' : '\1';
  bytes += pacing.extremes.empty() ? '\0' : '\1';
  put_array(bytes, pacing.times);
  put_array(bytes, pacing.levels);
  put_array(bytes, pacing.lifts);
  put_array(bytes, pacing.extremes);
  store_cached(cache, key, kPacingFiles, leg.from->name + ", " + leg.to->name, bytes);
}

/// A surface of a leg, and the estimate of extract_between().
struct MeasuredSurface {
  LegSurface leg_surface;
  LevelEstimate estimate;
};

/// Extracts the surface of a leg at `time`, which is also its eased time (linear easing).
Result<MeasuredSurface> measured_surface(const Leg& linear, float time, const LevelSearch& search,
                                         Engine& engine) {
  MeasuredSurface measured;
  LegState& state = measured.leg_surface.state;
  state.time = state.u = time;
  state.balls = balls_at(linear.plan, time);
  state.map = distance_map(linear, time, state.balls);
  PM_TRY(measured.estimate, extract_between(linear, search, engine, measured.leg_surface));
  return measured;
}

/// Returns the edge of the frames' cells, or of larger ones, of which `resolution` fill the box.
float limited_cell(const LegSettings& settings, float resolution) {
  return settings.cell * std::max(1.0f, static_cast<float>(settings.resolution) / resolution);
}

/// Measures the height of the lowest point of a surface on cells of about the frames' size. These
/// cells fill only a layer of the box, up to the lowest point of the larger cells' surface, which
/// is given without its fragments. A layer does not show what a fragment is, so the whole surface
/// is extracted if a fragment was lower (`below`).
Result<float> measure_low(const Leg& linear, const LegSurface& surface, bool below,
                          Engine& engine) {
  constexpr float kMaxResolution = 128;
  const LegSettings& settings = linear.settings;
  const float cell = limited_cell(settings, kMaxResolution);
  Box box = surface.state.map.box;
  const float low = bounding_box(surface.mesh.positions).low.y;
  // The surface may reach beyond the box by a cell.
  if (!below) box.high.y = std::clamp(low + cell, box.low.y, box.high.y);
  PM_TRY(Mesh mesh, extract_surface(engine, surface.field, box, cell, settings.measured));
  if (below) remove_fragments(linear, surface.state.time, mesh);
  return mesh.triangles.empty() ? low : bounding_box(mesh.positions).low.y;
}

/// Measures a moment of the leg on cells twice as large as the frames', but not below resolution 64
/// if they can be smaller, nor above 128, because more than a dozen surfaces are in memory at once.
/// Only the lowest point needs smaller cells. `near`: an estimate of the level.
Result<Moment> measure_moment(const Leg& linear, float time, LevelEstimate near, Engine& engine) {
  // Of the volume: twice that of frames. The estimate of the level is better by much.
  constexpr double kTolerance = 0.004;
  const LegSettings& settings = linear.settings;
  const float cell = limited_cell(
      settings, std::clamp(static_cast<float>(settings.resolution) / 2, 64.0f, 128.0f));
  PM_TRY(MeasuredSurface measured,
         measured_surface(linear, time, {cell, settings.measured, near, kTolerance}, engine));
  LegSurface& surface = measured.leg_surface;
  // As in frames: a component that separates changes the surface when it is removed.
  const float lowest = bounding_box(surface.mesh.positions).low.y;
  remove_fragments(linear, time, surface.mesh);
  float low = bounding_box(surface.mesh.positions).low.y;
  if (stays_on_floor(linear) && !surface.mesh.triangles.empty()) {
    PM_TRY(low, measure_low(linear, surface, /*below=*/lowest < low, engine));
  }
  return Moment{time, measured.estimate, low, std::move(surface.mesh), 0};
}

/// Divides steps with much more change than the mean, for instance where a limb grows, into
/// quarters. The quarters' changes are scaled to sum to the step's, because the mean distance of a
/// shrinking part falls with the square of its length.
Result<std::vector<Moment>> refine(const Leg& linear, std::vector<Moment> steps, double change,
                                   Engine& engine) {
  constexpr double kMaxChange = 1.5;  // relative to the mean step
  constexpr int kParts = 4;
  std::vector<Moment> moments;
  for (Moment& step : steps) {
    if (step.change * kSteps > kMaxChange * change) {
      const std::size_t previous = moments.size() - 1;
      const float time = moments[previous].time;
      const LevelEstimate before = moments[previous].estimate, after = step.estimate;
      double sum = 0;
      for (int i = 1; i < kParts; ++i) {
        const float t = static_cast<float>(i) / kParts;
        const LevelEstimate near{lerp(before.level, after.level, t),
                                 std::lerp(before.response, after.response, double{t})};
        PM_TRY(Moment inserted, measure_moment(linear, lerp(time, step.time, t), near, engine));
        if (inserted.surface.triangles.empty()) continue;
        sum += inserted.change = change_between(moments.back().surface, inserted.surface);
        moments.push_back(std::move(inserted));
      }
      const double step_change = step.change;
      sum += step.change = change_between(moments.back().surface, step.surface);
      const double scale = sum > 0 ? step_change / sum : 0;
      step.change *= scale;
      for (std::size_t i = previous + 1; i < moments.size(); ++i) moments[i].change *= scale;
    }
    moments.push_back(std::move(step));
  }
  return moments;
}

/// Measures kSteps + 1 moments at evenly spaced times; stops at the first without a surface.
Result<std::vector<Moment>> measure_steps(const Leg& linear, Engine& engine) {
  std::vector<Moment> steps;
  for (int k = 0; k <= kSteps; ++k) {
    LevelEstimate near;
    if (k > 1) {
      const LevelEstimate last = steps[steps.size() - 1].estimate;
      near = {2 * last.level - steps[steps.size() - 2].estimate.level, last.response};
    }
    PM_TRY(Moment moment, measure_moment(linear, step_time(k), near, engine));
    if (moment.surface.triangles.empty()) break;
    steps.push_back(std::move(moment));
  }
  // At its ends the leg has no level, and thus no response.
  if (steps.size() == kSteps + 1) {
    steps.front().estimate.response = steps[1].estimate.response;
    steps.back().estimate.response = steps[kSteps - 1].estimate.response;
  }
  parallel_for(static_cast<std::int64_t>(steps.size()) - 1, [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    steps[k + 1].change = change_between(steps[k].surface, steps[k + 1].surface);
  });
  return steps;
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
  if (auto stored = load_pacing(cache, key, leg)) return std::move(*stored);
  Pacing pacing;
  PM_TRY(pacing.registration, register_surfaces(linear, engine));
  linear.plan.from_offsets = pacing.registration.from_offsets;
  linear.plan.to_offsets = pacing.registration.to_offsets;
  PM_TRY(std::vector<Moment> steps, measure_steps(linear, engine));
  double change = 0;
  for (const Moment& step : steps) change += step.change;
  if (steps.size() == kSteps + 1 && change > 0) {
    PM_TRY(const std::vector<Moment> moments, refine(linear, std::move(steps), change, engine));
    pacing.times = linear.plan.pacing = even_times(moments, change);
    if (stays_on_floor(leg)) pacing.lifts = find_lifts(leg, moments, pacing.times);
    pacing.extremes = find_extremes(leg, moments);
    pacing.levels = find_levels(linear, moments);
  }
  store_pacing(cache, key, leg, pacing);
  return pacing;
}

}  // namespace polymorph
