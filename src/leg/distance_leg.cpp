#include "leg/distance_leg.h"

#include <algorithm>

#include "field/extract_surface.h"
#include "field/level.h"
#include "kernels/morph_field.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// Fade of a vessel (ObjectDistances::is_vessel) into its filled shape, over the progress from the
/// vessel's end of the leg. The fade ends before the other object tears the vessel's walls.
constexpr DetailFade kVesselFade = {/*begin=*/0, /*end=*/0.2f};

/// Replaces vessels by their filled shapes, so that the volume is kept as if they were solid.
MorphSurface fill_vessels(const Leg& leg, MorphSurface field) {
  if (leg.from->distances.is_vessel) field.from = field.smooth_from;
  if (leg.to->distances.is_vessel) field.to = field.smooth_to;
  return field;
}

/// Computes how far the surface shows a vessel's walls, whose volume is not kept: from 0 (the
/// vessel is filled) to 1. `u`: eased progress.
float wall_visibility(const Leg& leg, float u) {
  const auto visibility_at = [](float progress) {
    return smoothstep((kVesselFade.end - progress) / (kVesselFade.end - kVesselFade.begin));
  };
  float visibility = 0;
  if (leg.from->distances.is_vessel) visibility = visibility_at(u);
  if (leg.to->distances.is_vessel) visibility = std::max(visibility, visibility_at(1 - u));
  return visibility;
}

}  // namespace

FrameMap distance_map(const Leg& leg, float time, const BallSet& balls) {
  return frame_map(leg.plan, time, balls, object_size(leg, progress_at(leg.plan, time)),
                   {leg.from->distances.thinness, leg.to->distances.thinness});
}

bool keeps_volume(const Leg& leg) {
  return leg.plan.motion.keep_volume && !is_shell(leg.from->distances) &&
         !is_shell(leg.to->distances);
}

std::optional<float> interpolate_level(const std::vector<float>& levels, float u) {
  const std::vector<float>& level = levels;
  if (level.size() < 3) return std::nullopt;
  const auto last = level.size() - 1;
  const float x = std::clamp(u, 0.0f, 1.0f) * static_cast<float>(last);
  const std::size_t k = std::min(static_cast<std::size_t>(x), last - 1);
  const float t = x - static_cast<float>(k), t2 = t * t, t3 = t2 * t;
  // At either end of the list, this is the slope of the parabola through the three nearest levels.
  const auto slope = [&](std::size_t i) {
    if (i == 0) return 2 * level[1] - 1.5f * level[0] - 0.5f * level[2];
    if (i == last) return 1.5f * level[last] + 0.5f * level[last - 2] - 2 * level[last - 1];
    return 0.5f * (level[i + 1] - level[i - 1]);
  };
  return level[k] * (2 * t3 - 3 * t2 + 1) + level[k + 1] * (3 * t2 - 2 * t3) +
         slope(k) * (t3 - 2 * t2 + t) + slope(k + 1) * (t3 - t2);
}

Result<LevelEstimate> extract_between(const Leg& leg, const LevelSearch& search, Engine& engine,
                                      LegSurface& surface) {
  const LegState& state = surface.state;
  const ObjectDistances &from = leg.from->distances, &to = leg.to->distances;
  const FrameMap& map = state.map;
  MorphSurface& field = surface.field;
  field = {map.regression, from.grid, to.grid, map.from_scale, map.to_scale, /*level=*/0};
  LevelEstimate estimate;
  const bool at_an_end = state.time <= 0 || state.time >= 1;
  const bool has_shell = is_shell(from) || is_shell(to);
  // Compressed distances would thicken a shell's walls.
  if (!has_shell) field.linear_range = kLinearRange * object_size(leg, state.u);
  // Next to a shell, objects keep their detail; only a vessel fades into its filled shape.
  if (!has_shell || from.is_vessel) field.smooth_from = from.smooth;
  if (!has_shell || to.is_vessel) field.smooth_to = to.smooth;
  if (from.is_vessel) field.fade_from = kVesselFade;
  if (to.is_vessel) field.fade_to = kVesselFade;
  if (!at_an_end && keeps_volume(leg)) {
    const auto u = static_cast<double>(state.u);
    const double volume = (1 - u) * from.volume + u * to.volume;
    const VolumeGoal goal = {volume, leg.settings.cell, kMaxLevel * object_size(leg, state.u)};
    PM_TRY(LevelSurface level_surface,
           surface_of_volume(engine, fill_vessels(leg, field), map.box, search, goal));
    estimate = level_surface.estimate;
    const float walls = wall_visibility(leg, state.u);
    // The level fades out as the vessel's walls appear.
    field.level = (1 - walls) * (1 - walls) * level_surface.level;
    if (walls == 0) {
      surface.mesh = std::move(level_surface.mesh);
      return estimate;
    }
  } else if (!at_an_end && has_shell) {
    // A shell's volume means little, but its walls must have no holes. The level -1 moves the
    // surface outward by the level's weight, which is the amount by which walls must be thickened.
    PM_TRY(field.map, make_shortfall_regression(field, leg.plan, state.balls, engine));
    field.level = -1;
  }
  PM_TRY(surface.mesh, extract_surface(engine, field, map.box, search.cell, search.extract));
  return estimate;
}

Result<std::vector<float>> sample_distances(const MorphSurface& field,
                                            const std::vector<Vec3>& points, Engine& engine) {
  std::vector<AttributeValues> maps;
  PM_TRY_STATUS(to_status(engine.regress(field.map, points, maps)));
  MorphField host_field;
  // The regression's values already contain the affine maps, so these are set to zero.
  for (AffineMap& affine : host_field.map.affine)
    affine = {{Vec3{}, Vec3{}, Vec3{}}, /*offset=*/{}};
  host_field.object[0] = DistanceField(field.from->grid, field.from->values.data());
  host_field.object[1] = DistanceField(field.to->grid, field.to->values.data());
  if (field.smooth_from)
    host_field.object[0].set_detail(field.smooth_from->values.data(), field.fade_from);
  if (field.smooth_to)
    host_field.object[1].set_detail(field.smooth_to->values.data(), field.fade_to);
  host_field.scale[0] = field.from_scale, host_field.scale[1] = field.to_scale;
  host_field.level = field.level;
  host_field.inv_range = field.linear_range > 0 ? 1 / field.linear_range : 0;
  std::vector<float> values(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    // Per point: the four values of the map to the source, then those of the map to the target.
    const AttributeValues &a = maps[2 * i], &b = maps[2 * i + 1];
    const float both_maps[kRegressionValues] = {a.v[0], a.v[1], a.v[2], a.v[3],
                                                b.v[0], b.v[1], b.v[2], b.v[3]};
    values[i] = host_field.value(Points<float>{points[i].x, points[i].y, points[i].z}, both_maps);
  }
  return values;
}

}  // namespace polymorph
