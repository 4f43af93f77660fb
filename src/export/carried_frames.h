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

/// The largest distance between a carried mesh and the true surface, as a share of the smaller
/// object's diagonal.
inline constexpr float kCarriedError = 0.003f;

/// One mesh through some frames of a leg.
struct CarriedActor {
  std::vector<MorphState> moments;     ///< moments of the leg, rising
  std::vector<std::size_t> moment_of;  ///< index of each frame's moment
  CarriedMesh mesh;                    ///< its points at each moment
  std::vector<Vec2> corner_uvs;        ///< 3 per triangle: where they lie on the source's texture
  std::vector<float> errors;  ///< errors at each moment: Hausdorff distance over the diagonal
};

/// Frames of an actor, rising, of one leg.
struct ActorFrames {
  const Scene& scene;
  const PreparedActor& actor;
  std::span<const int> frames;
};

/// Carries the surface of an actor through its frames (mesh/carry/carry.h). Frames that show a
/// model show the surface that the cells make of it. `stopped` is asked before each surface that is
/// made and each move of the mesh, and ends the work with its error. Errors: kInput where the
/// frames belong to several legs or show boundary stages, where the topology changes, a triangle
/// would be inverted, or the error would exceed kCarriedError, each with frame and place;
/// kResource.
Result<CarriedActor> carry_actor(const ActorFrames& shown, Engine& engine,
                                 const std::function<Status()>& stopped);

/// The carried mesh in the place of the true surface of frame number `k` of them: normals, colours
/// and labels are that surface's where it is nearest, velocities lead to the next frame's points.
Result<SurfaceFrame> carried_frame(const ActorFrames& shown, const CarriedActor& carried,
                                   std::size_t k, Engine& engine);

}  // namespace polymorph
