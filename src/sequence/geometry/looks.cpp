#include "sequence/geometry/looks.h"

#include <algorithm>

#include "base/parallel.h"
#include "morph/motion.h"
#include "morph/pull_back.h"
#include "render/math/vector_math.h"
#include "sequence/geometry/leg_surface.h"

namespace polymorph {
namespace {

/// A model's own normals on a surface that is nearly the model: mixed in by `weight`, taken where
/// the surface comes from (goes to). Else a smoothly shaded model would show its faces as soon as
/// it moves.
void add_shading(const PreparedObject& object, const AffineMap& map, const std::vector<Vec3>& at,
                 float weight, std::vector<Vec3>& normals) {
  const Model& model = object.model;
  if (model.corner_normals.size() != 3 * model.triangles.size() || normals.size() != at.size())
    return;
  const std::vector<ClosestPoint> closest = object.outer->closest(at);
  // Gradients turn back by the transposed map.
  const auto turned = [&](Vec3 n) {
    return normalized(map.rows[0] * n.x + map.rows[1] * n.y + map.rows[2] * n.z);
  };
  parallel_for(
      static_cast<std::int64_t>(at.size()),
      [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        const Vec3 shading = turned(interpolate_normal(model, model.corner_normals, closest[i]));
        // Not where the surface is another: beside edges, in gaps that it closes.
        if (dot(shading, normals[i]) > 0.8f)
          normals[i] = normalized(lerp(normals[i], shading, weight));
      },
      256);
}

Vec3 plain_color(const PreparedObject& object, Vec3 at) {
  return object.colors ? object.colors->at(at) : object.model.materials.front().color;
}

/// The surface's colours without detail after a leg, on what they were before it. `is_last`: no
/// other leg's go on top of them.
void fade_colors(const PreparedActor& actor, const PreparedLeg& leg, const PullBack& pulled,
                 const ColorFade& fade, bool is_last, ActorGeometry& geometry) {
  const PreparedObject &from = actor.objects[leg.from], &to = actor.objects[leg.to];
  if (std::all_of(actor.objects.begin(), actor.objects.end(),
                  [](const PreparedObject& object) { return !object.colors; }))
    return;
  const float detail = (1 - geometry.color_share) * fade.source + fade.target;
  geometry.color_share = 1 - detail;
  if (is_last && detail >= 1) {  // nobody would see them
    geometry.colors.clear();
    return;
  }
  const bool starts_here = geometry.colors.empty();
  geometry.colors.resize(pulled.source.size());
  parallel_for(
      static_cast<std::int64_t>(pulled.source.size()),
      [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        Vec3& color = geometry.colors[at];
        if (starts_here && fade.color < 1) color = plain_color(from, pulled.source[at]);
        if (fade.color > 0) color = lerp(color, plain_color(to, pulled.target[at]), fade.color);
      },
      4096);
}

/// What goes through all legs that a surface is made of.
struct LooksOf {
  const PreparedActor& actor;
  Engine& engine;
  ActorGeometry& geometry;
};

/// Adds the looks of a leg, on those of the leg before it where that was left in flight.
Status add_looks(const LooksOf& of, std::size_t leg, float time, const BallSet& balls,
                 const FrameMap& map, const std::vector<Vec3>& points, bool is_last) {
  const PreparedActor& actor = of.actor;
  ActorGeometry& geometry = of.geometry;
  const PreparedLeg& way = actor.legs[leg];
  PM_TRY(const PullBack pulled, pulled_back(way, time, balls, map, points, of.engine));
  // Balls in flight had the look that the leg before them had made of its objects by then.
  const bool was_in_flight = leg > 0 && actor.legs[leg - 1].until < 1;
  const ColorFade fade = color_fade(std::clamp(progress_at(way.plan, time), 0.0f, 1.0f));
  // What has no share is not asked for.
  if (was_in_flight && fade.color < 1) {
    const PreparedLeg& before = actor.legs[leg - 1];
    const BallSet then = balls_at(before.plan, before.until);
    const FrameMap map_then =
        before.distance ? map_at(actor, before, before.until, then) : FrameMap{};
    PM_TRY_STATUS(add_looks(of, leg - 1, before.until, then, map_then, pulled.source, false));
  } else if (fade.color < 1) {
    geometry.layers.push_back(object_layer(actor, way.from, geometry.surface, pulled.source));
  }
  if (fade.color > 0)
    geometry.layers.push_back(
        object_layer(actor, way.to, geometry.surface, pulled.target, fade.color));
  fade_colors(actor, way, pulled, fade, is_last, geometry);
  return Ok{};
}

}  // namespace

ColorFade color_fade(float u) {
  return {smoothstep(0.2f, 0.8f, u), 1 - smoothstep(0.1f, 0.45f, u), smoothstep(0.55f, 0.9f, u)};
}

ObjectLayer object_layer(const PreparedActor& actor, std::size_t object, const Mesh& surface,
                         std::span<const Vec3> at, float share) {
  const PreparedObject& o = actor.objects[object];
  return {object, share, transfer_materials(o.model, *o.outer, o.charts, at, surface.triangles)};
}

Status blend_end_normals(const PreparedActor& actor, const PreparedLeg& leg, Engine& engine,
                         ActorGeometry& geometry) {
  // Gone before much has changed.
  constexpr float kGone = 0.3f;
  const float u = geometry.moment.u, near = std::min(u, 1 - u);
  if (near >= kGone || geometry.surface.normals.empty()) return Ok{};
  const float fade = 1 - near / kGone, weight = smoothstep(0, 1, fade);
  const FrameMap& map = geometry.map;
  PM_TRY(const PullBack pulled, pull_back(map, geometry.surface.positions, engine));
  const bool leaving = u < 0.5f;
  add_shading(actor.objects[leaving ? leg.from : leg.to], map.regression->affine[leaving ? 0 : 1],
              leaving ? pulled.source : pulled.target, weight, geometry.surface.normals);
  return Ok{};
}

Status transfer_looks(const PreparedActor& actor, std::size_t leg, float time, const BallSet& balls,
                      const FrameMap& map, const std::vector<Vec3>& points, Engine& engine,
                      ActorGeometry& geometry) {
  return add_looks({actor, engine, geometry}, leg, time, balls, map, points, true);
}

}  // namespace polymorph
