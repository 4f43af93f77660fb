// Frame geometry: each actor's balls, surface and mesh in a frame. It depends on the scene and the
// frame number only.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "kernels/mesh.h"
#include "leg/surface_look.h"
#include "morph/flow.h"
#include "morph/timeline.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// One actor at one moment. It shows the surface of a leg or mixture, or the model with the index
/// moment.object, or both while a model turns into its balls.
struct ActorGeometry {
  MorphState moment;         ///< state of the actor's motion (morph/timeline.h)
  BallSet balls;             ///< empty while only a model shows
  float iso = 1;             ///< level of the balls' field at which the surface lies
  Mesh surface;              ///< surface of the leg or mixture, or of the model's boundary stage
  std::vector<Vec3> points;  ///< points of the model; empty: no model shows
  std::shared_ptr<const Model>
      sequence_model;                ///< the model if a mesh sequence shows it, else null
  std::shared_ptr<const Leg> leg;    ///< leg, if balls show or a model turns into balls; else null
  std::vector<Vec3> corner_normals;  ///< 3 per triangle of the model; empty: its own normals
  std::shared_ptr<const Mixture> mixture;  ///< mixture of three objects or more; else null
  float lift = 0;                          ///< WeightedSurface::lift of the mixture's surface
  /// Motion until the next frame; only computed if needs_motion() (scene/scene.h).
  Flow flow;                       ///< motion of the surface's points; empty: still
  std::vector<Vec3> displacement;  ///< motion of the model's points; empty: still
  /// Index into the actor's label_names for each vertex; only computed for a label AOV.
  std::vector<std::uint32_t> surface_labels, point_labels;
  SurfaceLook look;  ///< look of the surface
  /// Scene-linear colours of the surface's and the model's points that replace materials and look
  /// (paint_origins.h); empty: none.
  std::vector<Vec3> surface_paint, point_paint;
  bool moves = true;  ///< whether the actor looks different in both neighbouring frames
};

/// Returns an actor's object by its index, MorphState::object.
inline const PreparedObject& object_of(const PreparedActor& actor, int object) {
  return *actor.objects[static_cast<std::size_t>(object)];
}

/// Returns the model that the actor shows: an object's, or a mesh of a sequence.
inline const Model& shown_model(const PreparedActor& actor, const ActorGeometry& geometry) {
  return geometry.sequence_model ? *geometry.sequence_model
                                 : object_of(actor, geometry.moment.object).model;
}

/// All actors in one frame.
struct FrameGeometry {
  int frame = 1;
  float t = 0;                        ///< sequence_time() (morph/timeline.h), [0, 1]
  std::string stage;                  ///< stage_names()
  std::vector<ActorGeometry> actors;  ///< one per actor of PreparedScene
};

/// Makes the surface of the actor's leg at a moment of its motion, with the surface's look, even if
/// the moment shows an object (MorphState::object). PreparedActor::offset is not applied. Errors:
/// kResource; as leg_at() (sequence/prepare/actor_poses.h).
Result<ActorGeometry> leg_geometry(const PreparedActor& actor, const MorphState& moment,
                                   Engine& engine);
/// Makes the same from the surface of `leg` at that moment, which leg_surface() has made before.
Result<ActorGeometry> leg_geometry(const PreparedActor& actor, const MorphState& moment,
                                   std::shared_ptr<const Leg> leg, LegSurface surface,
                                   Engine& engine);

/// Makes the geometry that the actor shows in a moment, without motion and labels. Errors:
/// kResource; kInput if a mesh of a sequence cannot be shown.
Result<ActorGeometry> actor_geometry_at(const PreparedActor& actor, const MorphState& moment,
                                        Engine& engine);

/// Computes the label of each vertex of geometry.surface, as an index into the actor's label_names.
/// Errors: the engine's.
Result<std::vector<std::uint32_t>> surface_labels(const ActorGeometry& geometry, Engine& engine);

/// Returns all visible geometry of an actor: its surface, its model, or both.
Mesh shown_mesh(const PreparedActor& actor, const ActorGeometry& geometry);

/// Makes the geometry of `frame`, in [1, prepared.frame_count]. Errors: kResource; kInput if a mesh
/// of a sequence cannot be shown.
Result<FrameGeometry> geometry_at(const PreparedScene& prepared, Engine& engine, int frame);

/// Lists the actors' stages in their order, without repetition: "volume, boundary-in".
std::string stage_names(const PreparedScene& prepared, int frame);

/// Counts the balls of all actors.
std::size_t ball_count(const FrameGeometry& geometry);
/// Concatenates the surfaces of all actors. Golden frames store the digest of the result.
Mesh join_surfaces(const FrameGeometry& geometry);

}  // namespace polymorph
