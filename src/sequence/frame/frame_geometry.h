// Frame geometry: each actor's balls, surface and mesh, as a function of the frame's number alone.
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

/// One actor at one moment.
struct ActorGeometry {
  MorphState moment;
  BallSet balls;  ///< empty while only a model shows
  float iso = 1;  ///< level of the balls' field that shows
  Mesh surface;   ///< surface of the leg, or of the boundary stage of the model `moment.object`
  std::vector<Vec3> points;                ///< points of the model `moment.object`, when one shows
  std::shared_ptr<const Model> mesh;       ///< model, where it is the mesh of a sequence
  std::shared_ptr<const Leg> leg;          ///< leg, where balls show or a model becomes them
  std::vector<Vec3> corner_normals;        ///< normals of those points; empty: the model's own
  std::shared_ptr<const Mixture> mixture;  ///< mixture of many objects, where the surface is one
  float lift = 0;                          ///< height by which that was raised
  /// Motion until the next frame, only where the scene asks for motion blur or for a layer that
  /// needs it: see wants_flow().
  Flow flow;                       ///< motion of the surface's points; empty = still
  std::vector<Vec3> displacement;  ///< motion of the model's points; empty = still
  /// Index into the actor's label_names of each vertex, only where the scene asks for the layer.
  std::vector<std::uint32_t> surface_labels, point_labels;
  SurfaceLook look;  ///< the surface's own
  /// Colours of the surface's and the model's points, scene-linear, that hide their materials and
  /// the look; empty: none (paint_origins.h).
  std::vector<Vec3> surface_paint, point_paint;
  bool moves = true;  ///< differs from the frames before and after
};

/// The object of an actor by a MorphState's number.
inline const PreparedObject& object_of(const PreparedActor& actor, int object) {
  return *actor.objects[static_cast<std::size_t>(object)];
}

/// The model that the actor shows: its object's, or the mesh of its sequence.
inline const Model& shown_model(const PreparedActor& actor, const ActorGeometry& geometry) {
  return geometry.mesh ? *geometry.mesh : object_of(actor, geometry.moment.object).model;
}

struct FrameGeometry {
  int frame = 1;
  float t = 0;                        ///< the scene's time [0, 1]
  std::string stage;                  ///< stage_names()
  std::vector<ActorGeometry> actors;  ///< one per actor of PreparedScene
};

/// The surface of the actor's leg at a moment of its motion, with its look, whatever
/// `moment.object` says; where the leg stands, without the actor's `offset`. Errors: kResource;
/// those of leg_at().
Result<ActorGeometry> leg_geometry(const PreparedActor& actor, const MorphState& moment,
                                   Engine& engine);

/// Whatever shows of the actor in a moment, without motion and labels. Errors: kResource; kInput
/// where the mesh of a sequence cannot be shown.
Result<ActorGeometry> actor_geometry_at(const PreparedActor& actor, const MorphState& moment,
                                        Engine& engine);

/// The label of each vertex of leg_geometry()'s surface, as an index into the actor's label_names.
/// Errors: the engine's.
Result<std::vector<std::uint32_t>> surface_labels(const ActorGeometry& geometry, Engine& engine);

/// All that is seen of an actor: its surface, its model where that shows, or both.
Mesh shown_mesh(const PreparedActor& actor, const ActorGeometry& geometry);

/// `frame` in [1, prepared.frame_count]. Errors: kResource; kInput where the mesh of a sequence
/// cannot be shown.
Result<FrameGeometry> geometry_at(const PreparedScene& prepared, Engine& engine, int frame);

/// The stages that the actors are in, each once, in the actors' order: "volume, boundary-in".
std::string stage_names(const PreparedScene& prepared, int frame);

/// The number of balls of all actors.
std::size_t ball_count(const FrameGeometry& geometry);
/// The balls' surfaces of all actors, one after the other: golden frames keep the digest of them.
Mesh join_surfaces(const FrameGeometry& geometry);

}  // namespace polymorph
