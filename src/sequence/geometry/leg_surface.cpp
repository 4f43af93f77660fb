#include "sequence/geometry/leg_surface.h"

#include <algorithm>

#include "field/extract_surface.h"
#include "field/level.h"
#include "kernels/morph_surface.h"
#include "mesh/components.h"
#include "mesh/fairing.h"
#include "mesh/handles.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

/// Between objects a surface has no more handles than the one that has more: what else there is,
/// where two parts touch or a thin one tears, is cut, as long as it is thin.
void cut_superfluous_handles(const PreparedActor& actor, const PreparedLeg& leg, float u,
                             Mesh& surface) {
  constexpr float kLongest = 0.15f;  // way around a handle, as a share of the objects' size
  const std::int64_t genus =
      std::max(actor.objects[leg.from].distances.genus, actor.objects[leg.to].distances.genus);
  cut_handles(surface, genus, kLongest * size_at(actor, leg, u));
}

}  // namespace

double min_component_share_of(const PreparedActor& actor, const PreparedLeg& leg,
                              float min_component_share) {
  // What comes off between two objects, a limb's tip perhaps, is left out unless it is as large as
  // a part that one of them has.
  constexpr double kFragment = 0.015;
  const auto min_share = static_cast<double>(min_component_share);
  if (!leg.distance || min_share <= 0) return min_share;
  const double smallest = std::min(actor.objects[leg.from].distances.smallest_component_share,
                                   actor.objects[leg.to].distances.smallest_component_share);
  return std::max(min_share, std::min(kFragment, 0.5 * smallest));
}

float size_at(const PreparedActor& actor, const PreparedLeg& leg, float u) {
  const float from = actor.objects[leg.from].model.box().diagonal(),
              to = actor.objects[leg.to].model.box().diagonal();
  return lerp(from, to, std::clamp(u, 0.0f, 1.0f));
}

Result<ActorGeometry> balls_on_way(const PreparedScene& prepared, const PreparedActor& actor,
                                   Engine& engine, int leg, float time) {
  const MorphPlan& plan = leg_of(actor, leg).plan;
  ActorGeometry geometry;
  geometry.moment.leg = leg;
  geometry.moment.time = time;
  geometry.moment.u = progress_at(plan, time);
  PM_TRY(geometry.balls, balls_at(plan, time, engine));
  if (!leg_of(actor, leg).distance && plan.motion.keep_volume && time > 0 && time < 1) {
    const auto u = static_cast<double>(geometry.moment.u);
    const double from = actor.objects[leg_of(actor, leg).from].ball_volume;
    const double to = actor.objects[leg_of(actor, leg).to].ball_volume;
    const double volume = (1 - u) * from + u * to;
    // Most of the search on cells twice as large, which cost a fourth.
    PM_TRY(const float near,
           iso_for_volume(engine, geometry.balls, 2 * actor.cell, prepared.extract, volume));
    PM_TRY(geometry.iso,
           iso_for_volume(engine, geometry.balls, actor.cell, prepared.extract, volume, near));
  }
  return geometry;
}

bool keeps_volume(const PreparedActor& actor, const PreparedLeg& leg) {
  return leg.plan.motion.keep_volume && !is_shell(actor.objects[leg.from].distances) &&
         !is_shell(actor.objects[leg.to].distances);
}

std::optional<float> level_at(const PreparedLeg& leg, float u) {
  const std::vector<float>& at = leg.levels;
  if (at.size() < 3) return std::nullopt;
  const auto last = at.size() - 1;
  const float x = std::clamp(u, 0.0f, 1.0f) * static_cast<float>(last);
  const std::size_t k = std::min(static_cast<std::size_t>(x), last - 1);
  const float t = x - static_cast<float>(k), t2 = t * t, t3 = t2 * t;
  // At an end that of the parabola through three.
  const auto slope = [&](std::size_t i) {
    if (i == 0) return 2 * at[1] - 1.5f * at[0] - 0.5f * at[2];
    if (i == last) return 1.5f * at[last] + 0.5f * at[last - 2] - 2 * at[last - 1];
    return 0.5f * (at[i + 1] - at[i - 1]);
  };
  return at[k] * (2 * t3 - 3 * t2 + 1) + at[k + 1] * (3 * t2 - 2 * t3) +
         slope(k) * (t3 - 2 * t2 + t) + slope(k + 1) * (t3 - t2);
}

FrameMap map_at(const PreparedActor& actor, const PreparedLeg& leg, float time,
                const BallSet& balls) {
  const ObjectDistances &from = actor.objects[leg.from].distances,
                        &to = actor.objects[leg.to].distances;
  return frame_map(leg.plan, time, balls, size_at(actor, leg, progress_at(leg.plan, time)),
                   from.thinness, to.thinness);
}

Result<PullBack> pulled_back(const PreparedLeg& leg, float time, const BallSet& balls,
                             const FrameMap& map, const std::vector<Vec3>& points, Engine& engine) {
  if (leg.distance) return pull_back(map, points, engine);
  return pull_back(leg.plan, time, balls, points, engine);
}

Result<Flow> flow_on_leg(const PreparedActor& actor, const PreparedLeg& leg, float time, float next,
                         const BallSet& balls, const std::vector<Vec3>& points, Engine& engine) {
  if (!leg.distance) return flow_at(leg.plan, time, next, balls, points, engine);
  const float size = size_at(actor, leg, progress_at(leg.plan, time));
  return flow_at(leg.plan, time, next, balls, size, points, engine);
}

Result<SurfaceBetween> surface_between(const PreparedActor& actor, const PreparedLeg& leg,
                                       const ActorGeometry& geometry, float cell,
                                       const ExtractSettings& extract, Engine& engine,
                                       const LevelSearch& search) {
  // Shares of the objects' size: no further may the level go for the volume's sake, and up to where
  // distances count nearly as they are.
  constexpr float kFurthest = 0.08f, kLinearRange = 0.06f;
  const MorphState& moment = geometry.moment;
  const PreparedObject &from = actor.objects[leg.from], &to = actor.objects[leg.to];
  const FrameMap& map = geometry.map;
  SurfaceBetween surface;
  MorphSurface& field = surface.field;
  field = {map.regression, from.distances.grid, to.distances.grid, map.from_scale, map.to_scale, 0};
  const bool at_an_end = moment.time <= 0 || moment.time >= 1;
  const bool has_shell = is_shell(from.distances) || is_shell(to.distances);
  // Walls would swell where both are compressed.
  if (!has_shell) field.linear_range = kLinearRange * size_at(actor, leg, moment.u);
  if (!at_an_end && keeps_volume(actor, leg)) {
    const auto u = static_cast<double>(moment.u);
    const double volume = (1 - u) * from.distances.volume + u * to.distances.volume;
    const VolumeGoal goal = {volume, actor.cell, kFurthest * size_at(actor, leg, moment.u),
                             search.near ? search.near : level_at(leg, moment.u), search.tolerance};
    PM_TRY(LevelSurface found, surface_of_volume(engine, field, map.box, cell, extract, goal));
    surface.mesh = std::move(found.mesh);
    field.level = found.level;
    return surface;
  }
  if (!at_an_end && has_shell) {
    // A wall's volume means little; that it is whole, much.
    PM_TRY(field.map, with_shortfalls(map, leg.plan, geometry.balls, *from.distances.grid,
                                      *to.distances.grid, engine));
    field.level = -1;
  }
  PM_TRY(surface.mesh, extract_surface(engine, field, map.box, cell, extract));
  return surface;
}

Result<ActorGeometry> volume_at(const PreparedScene& prepared, const PreparedActor& actor,
                                Engine& engine, int leg, float time) {
  PM_TRY(ActorGeometry geometry, balls_on_way(prepared, actor, engine, leg, time));
  ExtractSettings extract = prepared.extract;
  extract.iso = geometry.iso;
  extract.method = prepared.scene.surface.method;
  extract.placement = prepared.scene.surface.placement;
  extract.flat = prepared.scene.surface.flat;
  if (leg_of(actor, leg).distance) {
    geometry.map = map_at(actor, leg_of(actor, leg), time, geometry.balls);
    PM_TRY(SurfaceBetween surface,
           surface_between(actor, leg_of(actor, leg), geometry, actor.cell, extract, engine));
    geometry.surface = std::move(surface.mesh);
    geometry.between = std::move(surface.field);
  } else {
    PM_TRY(geometry.surface, extract_surface(engine, geometry.balls, actor.cell, extract));
  }
  // The cubes of a matrix are parts of their own.
  if (extract.method != SurfaceMethod::kMarchingCubes) return geometry;
  remove_small_components(geometry.surface,
                          min_component_share_of(actor, leg_of(actor, leg),
                                                 prepared.scene.surface.min_component_share));
  if (leg_of(actor, leg).distance) {
    mend_normals(geometry.surface);
    cut_superfluous_handles(actor, leg_of(actor, leg), geometry.moment.u, geometry.surface);
  }
  return geometry;
}

}  // namespace polymorph
