// Constant topology: one mesh of an actor through the frames of a leg, for morph targets and static
// indices. The mesh is carried along the surface's motion (mesh/carry/carry.h).
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "interchange/surface_frame.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "mesh/carry/carry.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// The largest allowed distance between a carried mesh and the true surface, as a fraction of the
/// smaller object's diagonal.
inline constexpr float kCarriedError = 0.003f;

/// One mesh through some frames of a leg.
struct CarriedActor {
  std::vector<MorphState> states;           ///< distinct states of the leg, by ascending time
  std::vector<std::size_t> state_of_frame;  ///< one per frame: index in `states`
  CarriedMesh mesh;                         ///< has the points in each state
  std::vector<Vec2> corner_uvs;  ///< 3 per triangle, on the source's texture; empty if it has none
  /// One per state: Hausdorff distance from the true surface, over the smaller object's diagonal.
  std::vector<float> errors;
  /// One per state: the true surface, or null where memory did not suffice to keep it.
  std::vector<std::shared_ptr<const LegSurface>> surfaces;
};

/// Frames of an actor that belong to one leg, in ascending order.
struct ActorFrames {
  const Scene& scene;
  const PreparedActor& actor;
  std::span<const int> frames;
};

/// Carries the surface of an actor through its frames. At the ends of a distance leg, which show an
/// object's own model, it is the leg's surface that is carried. `check_stop` is called before each
/// extraction and each move of the mesh; an error that it returns ends the work. Errors: kInput if
/// the frames belong to several legs or show boundary stages, if the topology changes, a triangle
/// would be inverted, or the error would exceed kCarriedError (the message names frame and
/// position); kResource.
Result<CarriedActor> carry_actor(const ActorFrames& actor_frames, Engine& engine,
                                 const std::function<Status()>& check_stop);

/// Makes the frame `actor_frames.frames[k]` with the carried mesh in place of the extracted
/// surface. Normals, colours and labels are those of the nearest points of the extracted surface.
/// Velocities lead to the points of the next frame; they are 0 in the last one.
Result<SurfaceFrame> make_carried_frame(const ActorFrames& actor_frames,
                                        const CarriedActor& carried, std::size_t k, Engine& engine);

}  // namespace polymorph
