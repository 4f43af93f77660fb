#include "sequence/frame/frame_geometry.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "assets/mesh_sequence.h"
#include "leg/boundary_surface.h"
#include "leg/leg_surface.h"
#include "leg/weighted_look.h"
#include "mesh/append.h"
#include "sequence/prepare/actor_poses.h"
#include "sequence/prepare/film_settings.h"

namespace polymorph {
namespace {

/// Joins the distinct names, in the order of their first occurrence.
std::string join_distinct(const std::vector<std::string>& names) {
  std::vector<std::string> seen;
  for (const std::string& name : names)
    if (std::find(seen.begin(), seen.end(), name) == seen.end()) seen.push_back(name);
  return fmt::format("{}", fmt::join(seen, ", "));
}

/// Returns the object whose model or boundary stage a moment shows. `leg`: the moment's leg.
const std::shared_ptr<const PreparedObject>& shown_object(const Leg& leg,
                                                          const MorphState& moment) {
  return moment.object == moment.leg ? leg.from : leg.to;
}

/// Makes the geometry of a moment that shows the model or the boundary stage of an object.
Result<ActorGeometry> model_geometry(const PreparedActor& actor, const MorphState& moment,
                                     Engine& engine) {
  ActorGeometry geometry;
  geometry.moment = moment;
  const bool leaving = moment.object == moment.leg;
  const MeshSequence* sequence = moving_sequence(actor, moment.object);
  if (sequence && moment.boundary == 1) {  // only the mesh shows
    PM_TRY(Model mesh, load_mesh(*sequence, leaving ? moment.mesh : moment.to_mesh));
    geometry.points = mesh.points;
    geometry.sequence_model = std::make_shared<const Model>(std::move(mesh));
    return geometry;
  }
  PM_TRY(geometry.leg, leg_at(actor, moment, engine));
  const std::shared_ptr<const PreparedObject>& object = shown_object(*geometry.leg, moment);
  // Points to the object's model, and shares ownership of the object.
  if (sequence) geometry.sequence_model = {object, &object->model};
  const BoundaryState boundary{leaving, moment.boundary, moment.growth};
  PM_TRY(BoundarySurface shown, boundary_surface(*geometry.leg, boundary, engine));
  geometry.balls = std::move(shown.balls);
  geometry.surface = std::move(shown.surface);
  geometry.points = std::move(shown.points);
  geometry.corner_normals = std::move(shown.corner_normals);
  const Mesh& surface = geometry.surface;
  if (actor.timeline.own_look && !surface.triangles.empty())
    geometry.look.layers.push_back(object_layer(object, surface.triangles, {surface.positions}));
  return geometry;
}

/// Makes the surface of objects that are mixed, with its look.
Result<ActorGeometry> mixture_geometry(const PreparedActor& actor, const MorphState& moment,
                                       Engine& engine) {
  ActorGeometry geometry;
  geometry.moment = moment;
  PM_TRY(Mixture mixture, mix_objects(*actor.space, moment.weights));
  PM_TRY(WeightedSurface surface, weighted_surface(mixture, engine));
  PM_TRY(PulledMixture pulled, pull_mixture_back(mixture, surface, engine));
  blend_weighted_normals(pulled, surface.mesh);
  if (actor.timeline.own_look && !surface.mesh.triangles.empty())
    geometry.look = weighted_look(pulled, surface.mesh.triangles);
  geometry.surface = std::move(surface.mesh);
  geometry.lift = surface.lift;
  geometry.mixture = std::make_shared<const Mixture>(std::move(mixture));
  return geometry;
}

/// Makes the geometry of an actor that plays a mesh sequence.
Result<ActorGeometry> sequence_geometry(const PreparedActor& actor, const MorphState& moment) {
  ActorGeometry geometry;
  geometry.moment = moment;
  PM_TRY(Model mesh, load_mesh(*actor.sequence, moment.mesh));
  geometry.points = mesh.points;
  geometry.sequence_model = std::make_shared<const Model>(std::move(mesh));
  return geometry;
}

/// Adds the motion until the next frame, or until the end of the stage if that comes first. The
/// change of the level that keeps the volume is not part of the motion. Boundary blends, whose
/// surfaces move by less than a cell, get no motion. `is_last`: no frame follows.
Status add_flow(const PreparedActor& actor, bool is_last, Engine& engine, ActorGeometry& geometry) {
  const MorphState& now = geometry.moment;
  const MorphState next = is_last ? now : morph_state_at(actor.timeline, now.frame + 1);
  if (actor.sequence) {  // a mesh sequence plays
    PM_TRY(geometry.displacement,
           compute_mesh_motion(*actor.sequence, *geometry.sequence_model,
                               {now.mesh, next.mesh, actor.timeline.playbacks.front().fps}));
    return Ok{};
  }
  if (actor.space) {  // three objects or more are mixed
    const bool is_model = !geometry.points.empty();
    if (now.weights == next.weights && is_model) return Ok{};  // the model stands still
    PM_TRY(Flow flow,
           weighted_flow(*actor.space, now.weights, next.weights,
                         is_model ? geometry.points : geometry.surface.positions, engine));
    if (is_model)
      geometry.displacement = std::move(flow.displacement);
    else
      geometry.flow = std::move(flow);
    return Ok{};
  }
  if (now.object < 0) {  // the surface of a leg shows
    const Leg& leg = *geometry.leg;
    const bool stays_in_leg = next.leg == now.leg && next.object < 0;
    LegState state;
    state.time = now.time;
    state.balls = geometry.balls;
    // The same leg, between the poses of the next frame.
    PM_TRY(const auto next_leg, leg_at(actor, now.leg, next.frame, engine));
    PM_TRY(geometry.flow, flow_until(leg, state, {*next_leg, stays_in_leg ? next.time : leg.until},
                                     geometry.surface.positions, engine));
    return Ok{};
  }
  // A model shows, or a boundary stage.
  if (geometry.points.empty()) return Ok{};
  if (const MeshSequence* sequence = moving_sequence(actor, now.object);
      sequence && now.boundary == 1) {  // a mesh of a sequence shows, as yet without its balls
    const auto index = static_cast<std::size_t>(now.object);
    const MeshStep step = {shown_mesh_number(actor.timeline, index, now.frame),
                           shown_mesh_number(actor.timeline, index, next.frame),
                           actor.timeline.playbacks[index].fps};
    PM_TRY(geometry.displacement, compute_mesh_motion(*sequence, *geometry.sequence_model, step));
    return Ok{};
  }
  if (next.object >= 0 && next.object != now.object) return Ok{};  // another object follows
  const float boundary = next.object < 0 ? 0 : next.boundary;
  // The displacement depends on 1 - boundary, which rounding may make equal for different values of
  // boundary.
  if (1 - boundary == 1 - now.boundary) return Ok{};
  geometry.displacement =
      boundary_displacement(*shown_object(*geometry.leg, now), geometry.points, boundary);
  return Ok{};
}

/// Makes the geometry that the actor shows in a moment; PreparedActor::offset is not applied.
Result<ActorGeometry> unshifted_geometry(const PreparedActor& actor, const MorphState& moment,
                                         Engine& engine) {
  if (actor.sequence) return sequence_geometry(actor, moment);
  if (moment.object >= 0) return model_geometry(actor, moment, engine);
  return actor.space ? mixture_geometry(actor, moment, engine)
                     : leg_geometry(actor, moment, engine);
}

/// Moves an actor's geometry by PreparedActor::offset.
void shift(const PreparedActor& actor, ActorGeometry& geometry) {
  if (actor.offset == Vec3{}) return;
  for (Vec3& p : geometry.surface.positions) p = p + actor.offset;
  for (Vec3& p : geometry.points) p = p + actor.offset;
  std::vector<Ball> balls = geometry.balls.balls();
  for (Ball& ball : balls) ball.center = ball.center + actor.offset;
  geometry.balls = std::move(balls);
}

/// Makes the geometry of an actor in a frame of the scene, which has `frame_count` frames, with
/// motion and labels; PreparedActor::offset is not applied.
Result<ActorGeometry> full_geometry(const PreparedActor& actor, const Scene& scene, int frame_count,
                                    int frame, Engine& engine) {
  const int film_frame = shown_frame(scene, frame);
  const bool turntable = scene.frames.turntable > 0;  // only the camera moves
  const bool is_last = turntable || frame == frame_count;
  const bool needs_labels =
      includes_aov(scene.image.aovs, "label") || includes_aov(scene.image.aovs, "crypto_label");
  const MorphState moment = morph_state_at(actor.timeline, film_frame);
  PM_TRY(ActorGeometry geometry, unshifted_geometry(actor, moment, engine));
  if (needs_motion(scene_at(scene, static_cast<double>(frame))))
    PM_TRY_STATUS(add_flow(actor, is_last, engine, geometry));
  geometry.moves = !turntable && differs_from_neighbours(actor.timeline, film_frame);
  if (needs_labels && !geometry.surface.positions.empty()) {
    PM_TRY(geometry.surface_labels, surface_labels(geometry, engine));
  }
  if (needs_labels && !geometry.points.empty()) {
    const Model& model = shown_model(actor, geometry);
    geometry.point_labels =
        model_labels(model, label_numbers(model.label_names, actor.label_names));
  }
  return geometry;
}

}  // namespace

Result<ActorGeometry> leg_geometry(const PreparedActor& actor, const MorphState& moment,
                                   Engine& engine) {
  PM_TRY(std::shared_ptr<const Leg> leg, leg_at(actor, moment.leg, moment.frame, engine));
  PM_TRY(LegSurface surface, leg_surface(*leg, moment.time, engine));
  return leg_geometry(actor, moment, std::move(leg), std::move(surface), engine);
}

Result<ActorGeometry> leg_geometry(const PreparedActor& actor, const MorphState& moment,
                                   std::shared_ptr<const Leg> leg, LegSurface surface,
                                   Engine& engine) {
  ActorGeometry geometry;
  geometry.moment = moment;
  PM_TRY(geometry.look, leg_look(*leg, actor.timeline.own_look, surface, engine));
  geometry.leg = std::move(leg);
  geometry.balls = std::move(surface.state.balls);
  geometry.iso = surface.iso;
  geometry.surface = std::move(surface.mesh);
  return geometry;
}

Result<ActorGeometry> actor_geometry_at(const PreparedActor& actor, const MorphState& moment,
                                        Engine& engine) {
  PM_TRY(ActorGeometry geometry, unshifted_geometry(actor, moment, engine));
  shift(actor, geometry);
  return geometry;
}

Result<std::vector<std::uint32_t>> surface_labels(const ActorGeometry& geometry, Engine& engine) {
  const MorphState& moment = geometry.moment;
  const std::vector<Vec3>& points = geometry.surface.positions;
  if (moment.object >= 0) return nearest_labels(*shown_object(*geometry.leg, moment), points);
  if (geometry.mixture) {
    const WeightedSurface surface{geometry.surface, geometry.lift};
    PM_TRY(const PulledMixture pulled, pull_mixture_back(*geometry.mixture, surface, engine));
    return weighted_labels(pulled);
  }
  LegState state;
  state.time = moment.time;
  state.balls = geometry.balls;
  return leg_labels(*geometry.leg, state, points, engine);
}

Mesh shown_mesh(const PreparedActor& actor, const ActorGeometry& geometry) {
  Mesh mesh = geometry.surface;
  if (!geometry.points.empty())
    append(mesh, model_mesh(shown_model(actor, geometry), geometry.points));
  return mesh;
}

Result<FrameGeometry> geometry_at(const PreparedScene& prepared, Engine& engine, int frame) {
  const int film_frame = shown_frame(prepared.scene, frame);
  FrameGeometry geometry{frame, sequence_time(prepared.scene, film_frame),
                         stage_names(prepared, frame), /*actors=*/{}};
  // Actors that share legs and times have the same geometry, which is made once.
  // `first_actors`: by first leg and times, the actor whose geometry is copied.
  std::map<std::tuple<const Leg*, int, int, int>, std::size_t> first_actors;
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    const PreparedActor& actor = prepared.actors[a];
    const Timeline& times = actor.timeline;
    if (!actor.legs.empty()) {
      const auto [first, is_new] = first_actors.try_emplace(
          {actor.legs.front().get(), times.start, times.steps, times.hold_start}, a);
      if (!is_new) {
        geometry.actors.push_back(geometry.actors[first->second]);
        continue;
      }
    }
    PM_TRY(ActorGeometry full,
           full_geometry(actor, prepared.scene, prepared.frame_count, frame, engine));
    geometry.actors.push_back(std::move(full));
  }
  for (std::size_t a = 0; a < prepared.actors.size(); ++a)
    shift(prepared.actors[a], geometry.actors[a]);
  return geometry;
}

std::string stage_names(const PreparedScene& prepared, int frame) {
  std::vector<std::string> names;
  for (const PreparedActor& actor : prepared.actors)
    names.emplace_back(
        stage_name(morph_state_at(actor.timeline, shown_frame(prepared.scene, frame)).stage));
  return join_distinct(names);
}

std::size_t ball_count(const FrameGeometry& geometry) {
  std::size_t count = 0;
  for (const ActorGeometry& actor : geometry.actors) count += actor.balls.size();
  return count;
}

Mesh join_surfaces(const FrameGeometry& geometry) {
  Mesh mesh;
  for (const ActorGeometry& actor : geometry.actors) append(mesh, actor.surface);
  return mesh;
}

}  // namespace polymorph
