// Constant topology: one mesh of an actor through the frames of a leg, for morph targets and static
// indices.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "base/result.h"
#include "interchange/surface_frame.h"
#include "kernels/engine.h"
#include "mesh/carry/carry.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// The largest distance between a carried mesh and the true surface, as a fraction of the smaller
/// object's diagonal.
inline constexpr float kCarriedError = 0.003f;

/// One mesh through some frames of a leg.
struct CarriedActor {
  std::vector<MorphState> moments;     ///< states of the leg, by rising time
  std::vector<std::size_t> moment_of;  ///< index in `moments`, per frame
  CarriedMesh mesh;                    ///< has the points in each state
  std::vector<Vec2> corner_uvs;        ///< 3 per triangle, on the source's texture
  std::vector<float> errors;           ///< per state: Hausdorff distance over the diagonal
};

/// Frames of an actor that belong to one leg, in rising order.
struct ActorFrames {
  const Scene& scene;
  const PreparedActor& actor;
  std::span<const int> frames;
};

/// Carries the surface of an actor through its frames (mesh/carry/carry.h). Frames that show a
/// model get the surface extracted from the leg instead. `stopped` is called before each extraction
/// and each move of the mesh; an error that it returns ends the work. Errors: kInput if the frames
/// belong to several legs or show boundary stages, if the topology changes, a triangle would be
/// inverted, or the error would exceed kCarriedError (the message names frame and position);
/// kResource.
Result<CarriedActor> carry_actor(const ActorFrames& shown, Engine& engine,
                                 const std::function<Status()>& stopped);

/// Makes the frame `shown.frames[k]` with the carried mesh in place of the extracted surface.
/// Normals, colours and labels are those of the nearest points of the extracted surface; velocities
/// lead to the points of the next frame.
Result<SurfaceFrame> make_carried_frame(const ActorFrames& shown, const CarriedActor& carried,
                                        std::size_t k, Engine& engine);

}  // namespace polymorph
