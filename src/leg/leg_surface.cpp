#include "leg/leg_surface.h"

#include <algorithm>

#include "field/extract_surface.h"
#include "field/level.h"
#include "leg/distance_leg.h"
#include "mesh/fairing.h"
#include "mesh/handles.h"
#include "morph/labels.h"
#include "morph/motion.h"

namespace polymorph {

Result<float> volume_iso(const Leg& leg, const LegState& state, Engine& engine) {
  const auto search = [&]() -> Result<float> {
    if (!leg.plan.motion.keep_volume || state.time <= 0 || state.time >= 1) return 1.0f;
    const LegSettings& settings = leg.settings;
    const auto u = static_cast<double>(state.u);
    const double volume = (1 - u) * leg.from->ball_volume + u * leg.to->ball_volume;
    // Most of the search runs on cells twice as large, which cost a fourth of the time.
    PM_TRY(const float estimate,
           iso_for_volume(engine, state.balls, {volume, 2 * settings.cell, settings.measured}));
    return iso_for_volume(engine, state.balls, {volume, settings.cell, settings.measured},
                          estimate);
  };
  return visit(leg, search, [](const DistanceLeg&) -> Result<float> { return 1.0f; });
}

Result<LegState> leg_state(const Leg& leg, float time, Engine& engine) {
  LegState state;
  state.time = time;
  state.u = progress_at(leg.plan, time);
  PM_TRY(state.balls, balls_at(leg.plan, time, engine));
  visit(
      leg, /*on_balls=*/[] {},
      [&](const DistanceLeg&) { state.map = distance_map(leg, time, state.balls); });
  return state;
}

Result<LegSurface> leg_surface(const Leg& leg, float time, Engine& engine) {
  LegSurface surface;
  PM_TRY(surface.state, leg_state(leg, time, engine));
  PM_TRY(surface.iso, volume_iso(leg, surface.state, engine));
  ExtractSettings shown = leg.settings.shown;
  shown.iso = surface.iso;
  PM_TRY_STATUS(visit(
      leg,
      [&]() -> Status {
        PM_TRY(surface.mesh,
               extract_surface(engine, surface.state.balls, leg.settings.cell, shown));
        return Ok{};
      },
      [&](const DistanceLeg& distances) -> Status {
        LevelSearch search = {leg.settings.cell, shown, /*near=*/{}};
        if (const auto level = interpolate_level(distances.levels, surface.state.u))
          search.near = LevelEstimate{*level};
        const auto estimate = extract_between(leg, search, engine, surface);
        if (!estimate) return estimate.error();
        return Ok{};
      }));
  // The matrix method's squares are not connected: each would be removed as a small component.
  if (shown.method != SurfaceMethod::kMarchingCubes) return surface;
  remove_fragments(leg, surface.state.u, surface.mesh);
  visit(
      leg, /*on_balls=*/[] {},
      [&](const DistanceLeg&) {
        repair_normals(surface.mesh);
        cut_superfluous_handles(std::max(leg.from->distances.genus, leg.to->distances.genus),
                                object_size(leg, surface.state.u), surface.mesh);
      });
  return surface;
}

void cut_superfluous_handles(std::int64_t genus, float size, Mesh& surface) {
  // Max length of the loop around a handle that is cut, as a fraction of `size`.
  constexpr float kMaxLength = 0.15f;
  cut_handles(surface, genus, kMaxLength * size);
}

Result<std::vector<float>> surface_field(const Leg& leg, const LegSurface& surface,
                                         const std::vector<Vec3>& points, Engine& engine) {
  const auto sample_balls = [&]() -> Result<std::vector<float>> {
    ExtractSettings settings = leg.settings.shown;
    settings.iso = surface.iso;
    std::vector<float> values;
    PM_TRY_STATUS(to_status(engine.sample(surface.state.balls, points, settings, values)));
    for (float& value : values) value = value / surface.iso - 1;
    return values;
  };
  return visit(leg, sample_balls,
               [&](const DistanceLeg&) { return sample_distances(surface.field, points, engine); });
}

Result<PullBack> pull_back(const Leg& leg, const LegState& state, const std::vector<Vec3>& points,
                           Engine& engine) {
  return visit(
      leg, [&] { return pull_back(leg.plan, state.time, state.balls, points, engine); },
      [&](const DistanceLeg&) { return pull_back(state.map, points, engine); });
}

Result<Flow> flow_until(const Leg& leg, const LegState& state, LegMoment next,
                        const std::vector<Vec3>& points, Engine& engine) {
  const PlanMoment now = {leg.plan, state.time}, next_moment = {next.leg.plan, next.time};
  return visit(
      leg, [&] { return flow_at(now, next_moment, state.balls, points, engine); },
      [&](const DistanceLeg&) {
        const float size = object_size(leg, progress_at(leg.plan, state.time));
        return evaluate_flow(make_flow_regression(now, next_moment, state.balls, size), points,
                             engine);
      });
}

Result<std::vector<std::uint32_t>> leg_labels(const Leg& leg, const LegState& state,
                                              const std::vector<Vec3>& points, Engine& engine) {
  const auto list_ball_labels = [](const PreparedObject& object) {
    std::vector<std::uint32_t> labels;
    for (const std::uint32_t label : object.ball_labels)
      labels.push_back(object.label_numbers[label]);
    return labels;
  };
  return label_points({leg.plan, state.time}, state.balls, points,
                      {list_ball_labels(*leg.from), list_ball_labels(*leg.to)}, engine);
}

}  // namespace polymorph
