#include "sequence/geometry/geometry.h"

#include <algorithm>

#include "field/extract_surface.h"
#include "field/level.h"
#include "leg/crossfade.h"
#include "mesh/append.h"
#include "mesh/normals.h"
#include "morph/motion.h"
#include "sequence/geometry/frame_labels.h"
#include "sequence/geometry/leg_surface.h"
#include "sequence/geometry/looks.h"

namespace polymorph {
namespace {

std::string each_once(const std::vector<std::string>& names) {
  std::vector<std::string> seen;
  for (const std::string& name : names)
    if (std::find(seen.begin(), seen.end(), name) == seen.end()) seen.push_back(name);
  return fmt::format("{}", fmt::join(seen, ", "));
}

/// The model that shows, as it stands.
Mesh model_mesh(const PreparedActor& actor, const ActorGeometry& geometry) {
  Model model = object_of(actor, geometry.moment.object).model;
  model.points = geometry.points;
  return {model.points, point_normals(model), model.triangles};
}

/// The moment of a stage in which a model shows, whole or on its way to or from its balls.
Result<ActorGeometry> model_at(const PreparedScene& prepared, const PreparedActor& actor,
                               Engine& engine, const MorphState& moment) {
  ActorGeometry geometry;
  geometry.moment = moment;
  const PreparedObject& object = object_of(actor, moment.object);
  const bool own_look = prepared.scene.look.kind == LookKind::kOwn;
  const auto add_own_layer = [&] {
    if (own_look)
      geometry.layers.push_back(object_layer(actor, static_cast<std::size_t>(moment.object),
                                             geometry.surface, geometry.surface.positions));
  };
  const float way = 1 - moment.boundary;  // from the model to its balls
  if (way <= 0) {
    geometry.points = object.model.points;
    return geometry;
  }
  switch (object.boundary) {
    case BoundaryMethod::kBlend: {
      PM_TRY(geometry.surface, blend_surface(object.blend, object.model, *object.closest, way,
                                             prepared.extract, engine));
      add_own_layer();
      return geometry;
    }
    case BoundaryMethod::kProject: {
      MovingMesh mesh = projected_mesh(object.model, object.projection, way);
      geometry.points = std::move(mesh.points);
      geometry.corner_normals = std::move(mesh.corner_normals);
      return geometry;
    }
    case BoundaryMethod::kCrossfade:
      break;
    case BoundaryMethod::kCut:
      PM_CHECK(false);  // has no such stage
  }
  if (moment.boundary > 0)
    geometry.points = shrunk_points(object.model, object.shrink_targets, moment.boundary);
  PM_TRY(const BallSet balls, balls_at(leg_of(actor, moment.leg).plan, moment.time, engine));
  geometry.balls =
      grown(balls.balls(), prepared.scene.field.kind, moment.growth, object.field_maximum);
  PM_TRY(geometry.surface, extract_surface(engine, geometry.balls, actor.cell, prepared.extract));
  add_own_layer();
  return geometry;
}

/// Where what shows now goes until the next frame, within its stage. What the level does to keep
/// the volume is left out, and so are blended surfaces, which move by less than a cell.
Status add_flow(const PreparedActor& actor, Engine& engine, bool last, ActorGeometry& geometry) {
  const MorphState& now = geometry.moment;
  const MorphState next = last ? now : morph_state_at(actor.timeline, now.frame + 1);
  if (now.object < 0) {
    const PreparedLeg& leg = leg_of(actor, now.leg);
    const bool goes_on = next.leg == now.leg && next.object < 0;
    const float then = goes_on ? next.time : leg.until;
    PM_TRY(geometry.flow, flow_on_leg(actor, leg, now.time, then, geometry.balls,
                                      geometry.surface.positions, engine));
    return Ok{};
  }
  const PreparedObject& object = object_of(actor, now.object);
  if (object.boundary != BoundaryMethod::kProject || geometry.points.empty()) return Ok{};
  if (next.object >= 0 && next.object != now.object) return Ok{};
  const float way = next.object < 0 ? 1 : 1 - next.boundary;
  if (way == 1 - now.boundary) return Ok{};
  geometry.displacement = projected_mesh(object.model, object.projection, way).points;
  for (std::size_t i = 0; i < geometry.points.size(); ++i)
    geometry.displacement[i] = geometry.displacement[i] - geometry.points[i];
  return Ok{};
}

}  // namespace

Result<ActorGeometry> boundary_at(const PreparedScene& prepared, const PreparedActor& actor,
                                  Engine& engine, int leg, bool leaving, float way) {
  MorphState moment;
  moment.leg = leg;
  moment.object = static_cast<int>(leaving ? leg_of(actor, leg).from : leg_of(actor, leg).to);
  if (object_of(actor, moment.object).boundary == BoundaryMethod::kCut) way = 0;
  moment.time = leaving ? 0.0f : 1.0f;
  moment.boundary = 1 - way;
  moment.growth = way;
  return model_at(prepared, actor, engine, moment);
}

Result<ActorGeometry> leg_geometry(const PreparedScene& prepared, const PreparedActor& actor,
                                   Engine& engine, const MorphState& moment) {
  PM_TRY(ActorGeometry one, volume_at(prepared, actor, engine, moment.leg, moment.time));
  one.moment = moment;
  if (leg_of(actor, moment.leg).distance)
    PM_TRY_STATUS(blend_end_normals(actor, leg_of(actor, moment.leg), engine, one));
  if (prepared.scene.look.kind == LookKind::kOwn && !one.surface.triangles.empty())
    PM_TRY_STATUS(transfer_looks(actor, static_cast<std::size_t>(moment.leg), moment.time,
                                 one.balls, one.map, one.surface.positions, engine, one));
  return one;
}

Mesh shown_mesh(const PreparedActor& actor, const ActorGeometry& geometry) {
  Mesh mesh = geometry.surface;
  if (!geometry.points.empty()) append(mesh, model_mesh(actor, geometry));
  return mesh;
}

Result<FrameGeometry> geometry_at(const PreparedScene& prepared, Engine& engine, int frame) {
  FrameGeometry geometry;
  geometry.frame = frame;
  const int shown = shown_frame(prepared.scene, frame);
  const bool turned = prepared.scene.frames.turntable > 0;  // nothing but the camera moves
  const bool last = turned || frame == prepared.frame_count;
  geometry.t = sequence_time(prepared.scene, shown);
  geometry.stage = stage_names(prepared, frame);
  const bool flows = wants_flow(scene_at(prepared.scene, static_cast<double>(frame)));
  for (const PreparedActor& actor : prepared.actors) {
    const MorphState moment = morph_state_at(actor.timeline, shown);
    if (moment.object >= 0) {
      PM_TRY(ActorGeometry one, model_at(prepared, actor, engine, moment));
      if (flows) PM_TRY_STATUS(add_flow(actor, engine, last, one));
      geometry.actors.push_back(std::move(one));
      continue;
    }
    PM_TRY(ActorGeometry one, leg_geometry(prepared, actor, engine, moment));
    if (flows) PM_TRY_STATUS(add_flow(actor, engine, last, one));
    geometry.actors.push_back(std::move(one));
  }
  for (std::size_t a = 0; a < prepared.actors.size(); ++a)
    geometry.actors[a].moves = !turned && moves_at(prepared.actors[a].timeline, shown);
  if (aov_is_chosen(prepared.scene.image.aovs, "label") ||
      aov_is_chosen(prepared.scene.image.aovs, "crypto_label"))
    for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
      const PreparedActor& actor = prepared.actors[a];
      ActorGeometry& one = geometry.actors[a];
      if (!one.surface.positions.empty()) {
        PM_TRY(one.surface_labels, surface_labels(actor, one, engine));
      }
      if (!one.points.empty())
        one.point_labels = model_labels(actor, object_of(actor, one.moment.object));
    }
  return geometry;
}

std::string stage_names(const PreparedScene& prepared, int frame) {
  std::vector<std::string> names;
  for (const PreparedActor& actor : prepared.actors)
    names.emplace_back(
        stage_name(morph_state_at(actor.timeline, shown_frame(prepared.scene, frame)).stage));
  return each_once(names);
}

std::size_t ball_count(const FrameGeometry& geometry) {
  std::size_t count = 0;
  for (const ActorGeometry& actor : geometry.actors) count += actor.balls.size();
  return count;
}

Mesh surfaces_of(const FrameGeometry& geometry) {
  Mesh mesh;
  for (const ActorGeometry& actor : geometry.actors) append(mesh, actor.surface);
  return mesh;
}

}  // namespace polymorph
