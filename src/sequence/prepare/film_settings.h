// Settings and camera of single frames, whose values may change over the film, and frame hashes.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "assets/content_hash.h"
#include "render/render.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// The settings, camera and ground of one frame.
struct FrameView {
  Scene scene;  ///< scene_at() this frame (morph/timeline.h): keyframes are resolved
  Camera camera;
  std::optional<CameraMotion> camera_motion;  ///< empty: the camera stands still around this frame
  std::optional<Camera> rig;                  ///< camera that the lights follow; empty: `camera`
  GroundSettings ground;                      ///< ground whose height is set
};

/// Makes the view of `frame`, in [1, prepared.frame_count].
FrameView make_frame_view(const PreparedScene& prepared, int frame);

/// Tests whether the scene's camera moves, rotates or zooms.
bool camera_moves(const Scene& scene);

/// Computes the framing (render/render.h) of a film with a moving camera. `points`: points of all
/// objects.
Framing film_framing(const Scene& scene, std::span<const Vec3> points);

/// Computes the components of frame_hash() from the scene's files; no balls are made.
SequenceHashes hash_sequence(const SceneInputs& inputs);

/// Hashes everything that decides a frame's files: the scene's inputs and its settings at this
/// frame. The result is hashes.scene, the same for all frames, in two cases: if no setting has
/// keyframes, the camera does not move and there are no mesh sequences; or if the framing of a
/// moving camera depends on where `retarget` leaves the balls, which only preparation finds.
std::string frame_hash(const Scene& scene, const SequenceHashes& hashes, int frame);

}  // namespace polymorph
