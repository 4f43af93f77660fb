// Frame geometry: each actor's balls, surface and mesh, as a function of the frame's number alone.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "kernels/mesh.h"
#include "sequence/geometry/actor_geometry.h"

namespace polymorph {

struct FrameGeometry {
  int frame = 1;
  float t = 0;                        ///< the scene's time [0, 1]
  std::string stage;                  ///< stage_names()
  std::vector<ActorGeometry> actors;  ///< as in PreparedScene
};

/// A model on its way to its balls' surface, at the beginning (`leaving`) or the end of a leg:
/// `way` 0 is the model, 1 what is taken for the balls' surface. For an object without a boundary
/// stage the model. Errors: kResource.
Result<ActorGeometry> boundary_at(const PreparedScene& prepared, const PreparedActor& actor,
                                  Engine& engine, int leg, bool leaving, float way);

/// The surface of a leg at a moment of its motion, with its look, whatever `moment.object` says.
/// Errors: kResource.
Result<ActorGeometry> leg_geometry(const PreparedScene& prepared, const PreparedActor& actor,
                                   Engine& engine, const MorphState& moment);

/// What is seen of an actor: its surface, its model where that shows, or both.
Mesh shown_mesh(const PreparedActor& actor, const ActorGeometry& geometry);

/// Does a frame with these settings show where things move?
inline bool wants_flow(const Scene& scene) {
  return scene.camera.shutter > 0 || aov_is_chosen(scene.image.aovs, "motion") ||
         aov_is_chosen(scene.image.aovs, "morph");
}

/// `frame` in [1, prepared.frame_count]. Errors: kResource.
Result<FrameGeometry> geometry_at(const PreparedScene& prepared, Engine& engine, int frame);

/// The stages that the actors are in, each once, in the actors' order: "volume, boundary-in".
std::string stage_names(const PreparedScene& prepared, int frame);

/// Of all actors.
std::size_t ball_count(const FrameGeometry& geometry);
/// The balls' surfaces of all actors, one after the other: what golden frames keep the digest of.
Mesh surfaces_of(const FrameGeometry& geometry);

}  // namespace polymorph
